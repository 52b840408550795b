# SPDX-License-Identifier: BSD-3-Clause
"""Texts as sentences."""
import pytest

from process_visualizer.gui.toolkit.labels import sentence


@pytest.mark.parametrize('text, shown', [
    ('the recorder does not answer', 'The recorder does not answer'),
    ('RViz is gone', 'RViz is gone'),
    ('cell.xml:3: a problem', 'cell.xml:3: a problem'),
    ('/tmp/a.bag is empty', '/tmp/a.bag is empty'),
    ('ur_rt_upper is silent', 'ur_rt_upper is silent'),
    ('xArm is silent', 'xArm is silent'),
    ('', ''), ('späte Daten', 'Späte Daten')])
def test_a_sentence_begins_with_a_capital_letter_but_for_names(text: str, shown: str) -> None:
    assert sentence(text) == shown
