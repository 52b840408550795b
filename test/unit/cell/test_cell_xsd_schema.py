# SPDX-License-Identifier: BSD-3-Clause
"""The schema agrees with the parser as far as a schema can."""
import re
from pathlib import Path
from typing import Callable, Iterator, List, Tuple

import pytest
from bad_input import BAD_INPUT, Bad
from configurations import VALUES, configurations
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from lxml import etree

from process_visualizer.cell.elements import TAGS
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.reference_and_schema import schema_text
from process_visualizer.cell.values import CONVERTERS
from process_visualizer.cell.xml_parser import XmlParser

REPOSITORY = Path(__file__).resolve().parents[3]
KINDS = sorted({attribute.kind for tag in TAGS.values() for attribute in tag.attributes.values()}
               - {'choice', 'text', 'command_line'})
STRICTER_PARSER = ('path', 'axis')
"""Kinds with rules that a schema cannot express: no `..` in a path, no axis of zero length."""


def test_committed_schema_is_up_to_date() -> None:
    """Otherwise run scripts/make_reference.py."""
    assert (REPOSITORY / 'devices.xsd').read_text(encoding='utf-8') == schema_text()


@pytest.mark.parametrize('path', [
    REPOSITORY / 'devices.xml', REPOSITORY / 'test' / 'data' / 'listing_5_1.xml',
    *sorted((REPOSITORY / 'sewing_cell' / 'devices').glob('*.xml'))], ids=lambda path: path.name)
def test_configurations_of_the_repository(schema: etree.XMLSchema, path: Path) -> None:
    XmlParser().parse(str(path))
    schema.assertValid(etree.parse(str(path)))


def is_valid(schema: etree.XMLSchema, text: str) -> bool:
    try:
        return bool(schema.validate(etree.fromstring(text.encode())))
    except etree.XMLSyntaxError:
        return False


@pytest.mark.parametrize('bad', BAD_INPUT, ids=lambda bad: bad.name)
def test_bad_input(schema: etree.XMLSchema, bad: Bad) -> None:
    """The schema refuses what it can detect; the other cases are listed as such."""
    assert is_valid(schema, bad.text) is not bad.schema_sees


def test_every_element_and_attribute_is_documented() -> None:
    root = etree.fromstring(schema_text().encode())
    for node in root.iter('{*}complexType', '{*}attribute'):
        text = node.findtext('{*}annotation/{*}documentation')
        assert text and '`' not in text


@settings(max_examples=80)
@given(text=configurations())
def test_what_the_parser_accepts_is_valid(schema: etree.XMLSchema,
                                          tmp_path_factory: pytest.TempPathFactory,
                                          text: str) -> None:
    path = tmp_path_factory.getbasetemp() / 'random.xml'
    path.write_text(text, encoding='utf-8')
    try:
        XmlParser().parse(str(path))
    except ConfigurationError:
        assume(False)
    schema.assertValid(etree.fromstring(text.encode()))


@pytest.fixture(scope='module')
def value_schema() -> etree.XMLSchema:
    """A schema with an element for each kind of value, named like the kind."""
    elements = ''.join(f'<xs:element name="{kind}"><xs:complexType><xs:attribute name="value" '
                       f'type="{kind}"/></xs:complexType></xs:element>' for kind in KINDS)
    text = schema_text().replace('</xs:schema>', elements + '</xs:schema>')
    return etree.XMLSchema(etree.fromstring(text.encode()))


def texts() -> 'st.SearchStrategy[str]':
    """Valid values of any kind, such values with a change, and similar texts."""
    right = st.one_of(*VALUES.values())
    spoiled = st.builds(lambda text, place, extra: text[:place] + extra + text[place + 1:],
                        right, st.integers(0, 8),
                        st.sampled_from(['', ' ', '/', '//', '~', '.', '-', '+', 'e', '1', '[0]',
                                         '_', '#', 'ä', '\n', '\t', '\u00a0', '٣', '$']))
    alike = st.text('0123456789.+-eEinfa \t/~_[]#', max_size=8)
    return st.one_of(right, spoiled, alike)


def accepts(kind: str, text: str) -> bool:
    try:
        CONVERTERS[kind](text)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize('kind', KINDS)
@settings(max_examples=80)
@given(text=texts())
@example(text='0E')
def test_values(value_schema: etree.XMLSchema, kind: str, text: str) -> None:
    assume('$(' not in text)
    element = etree.Element(kind, value=text)
    valid = bool(value_schema.validate(element))
    accepted = accepts(kind, text)
    assert valid == accepted or (valid and kind in STRICTER_PARSER)


@pytest.mark.parametrize('kind', KINDS)
def test_substitution_arguments_are_valid_everywhere(value_schema: etree.XMLSchema,
                                                     kind: str) -> None:
    for text in ('$(arg x)', 'a/$(find b)/c', '0 0 $(env Z)'):
        value_schema.assertValid(etree.Element(kind, value=text))


def examples() -> Iterator[Tuple[int, str]]:
    """Line and text of each XML example in the reference."""
    text = (REPOSITORY / 'docs' / 'configuration.md').read_text(encoding='utf-8')
    for match in re.finditer(r'```xml\n(.*?)```', text, re.DOTALL):
        yield text[:match.start()].count('\n') + 2, match[1]


@pytest.mark.parametrize('line, text', examples(), ids=lambda value: str(value)[:4])
def test_examples_of_the_reference(schema: etree.XMLSchema, parse: Callable[..., object],
                                   line: int, text: str) -> None:
    parse(text)
    schema.assertValid(etree.fromstring(text.encode()))


def test_there_are_examples() -> None:
    assert len(list(examples())) >= 4


def test_problems_in_the_reference_are_real(problems: Callable[..., List[str]]) -> None:
    """The messages in the reference are those of the parser."""
    lines = problems('<visualizer>\n\n<device type="other" name="a">\n'
                     '<base frame="f" xyz="0 0"/>\n\n\n<rviz type="MarkerAray"/></device>'
                     '</visualizer>')
    text = (REPOSITORY / 'docs' / 'configuration.md').read_text(encoding='utf-8')
    for line in lines:
        assert line.replace('cell.xml', 'my_cell.xml') in text
