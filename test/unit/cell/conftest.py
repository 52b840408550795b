# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures that parse text as a configuration file."""
from pathlib import Path
from typing import Callable, List

import pytest
from lxml import etree

from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Cell
from process_visualizer.cell.reference_and_schema import schema_text
from process_visualizer.cell.xml_parser import XmlParser


@pytest.fixture
def parse(tmp_path: Path) -> Callable[..., Cell]:
    """Parses text; keyword arguments are values for its <arg> elements."""
    def parse_text(text: str, **arguments: str) -> Cell:
        path = tmp_path / 'cell.xml'
        path.write_text(text, encoding='utf-8')
        return XmlParser(arguments).parse(str(path))
    return parse_text


@pytest.fixture
def problems(parse: Callable[..., Cell], tmp_path: Path) -> Callable[..., List[str]]:
    """The problems of the text, one line each, with paths relative to the file's folder."""
    def find(text: str, **arguments: str) -> List[str]:
        with pytest.raises(ConfigurationError) as caught:
            parse(text, **arguments)
        lines = str(caught.value).splitlines()
        return [line.replace(f'{tmp_path}/', '') for line in lines]
    return find


@pytest.fixture(scope='session')
def schema() -> etree.XMLSchema:
    """The schema made from the language."""
    return etree.XMLSchema(etree.fromstring(schema_text().encode()))
