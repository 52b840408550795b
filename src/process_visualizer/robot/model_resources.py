# SPDX-License-Identifier: BSD-3-Clause
"""The meshes and textures named in a model, and their files.

RViz opens URIs, with the packages that ROS finds. A model may also name paths, or packages that are
not installed but beside the model, as exported by CAD programs.
"""
from __future__ import annotations

import os
import re
from collections import Counter
from typing import Dict, Iterator, List, Optional
from urllib.parse import quote, unquote
from xml.etree import ElementTree
from xml.sax.saxutils import escape, unescape

import rospkg

from process_visualizer.cell.errors import missing_file
from process_visualizer.cell.substitution import package_advice
from process_visualizer.cell.trust import is_below

_NAMED = re.compile(r'(<(?:mesh|texture)\b[^>]*?\bfilename\s*=\s*)(["\'])(.*?)\2', re.DOTALL)
_PACKAGE_NAME = re.compile(r'<name\b[^>]*>\s*([^<\s]+)\s*</name>')
_SIGNS = {'&quot;': '"', '&apos;': "'"}
_ENTITIES = {sign: it for it, sign in _SIGNS.items()}
_LEVELS = 4  # searched folders: that of the model and those above it
_MAX_LISTED = 3
_ON_THE_WEB = ('http', 'https')


def with_resources(text: str, model_file: str) -> str:
    """Return a URDF with names that RViz can open for files beside the model.

    Paths become file URIs, as do packages that are not installed but are a folder above the
    model's file, or in such a folder. Names of missing files are unchanged.
    """
    packages = rospkg.RosPack()

    def renamed(named: 're.Match[str]') -> str:
        found = _beside(unescape(named[3], _SIGNS), model_file, packages)
        name = named[3] if found is None else escape(f'file://{quote(found)}', _ENTITIES)
        return f'{named[1]}{named[2]}{name}{named[2]}'
    return _NAMED.sub(renamed, text)


def without_foreign_resources(root: ElementTree.Element) -> List[str]:
    """Remove meshes and textures outside installed packages from a URDF; return their names.

    RViz would open any file, or ask any computer for it. RViz's XML parser ignores namespaces, so
    elements in a namespace count like all others.
    """
    packages = rospkg.RosPack()
    foreign: List[str] = []
    for parent in list(root.iter()):
        for child in list(parent):
            if any(_is_foreign(it.get('filename', ''), packages) for it in _named_in(child)):
                foreign += [it.get('filename', '') for it in _named_in(child)]
                parent.remove(child)
    return list(dict.fromkeys(foreign))


def _named_in(element: ElementTree.Element) -> List[ElementTree.Element]:
    """Return the meshes or texture that are removed with an element."""
    tag = _local_name(element)
    if tag in ('visual', 'collision'):
        return [it for it in element.iter() if _local_name(it) == 'mesh']
    return [element] if tag in ('mesh', 'texture') else []


def _local_name(element: ElementTree.Element) -> str:
    return element.tag.rpartition('}')[2]


def _is_foreign(uri: str, packages: rospkg.RosPack) -> bool:
    if not uri:
        return False
    path = resource_path(uri, packages) if uri.startswith('package://') else ''
    if not path:
        return True
    return not is_below(path, packages.get_path(uri[len('package://'):].partition('/')[0]))


def resource_path(uri: str, packages: rospkg.RosPack) -> str:
    """Return the file that RViz opens for a URI; '' for a web address or a missing package."""
    scheme, _, rest = uri.partition('://')
    if scheme == 'file':
        return unquote(rest)
    package, _, path = rest.partition('/')
    try:
        return os.path.join(packages.get_path(package), unquote(path)) \
            if scheme == 'package' else ''
    except rospkg.ResourceNotFound:
        return ''


def missing_resources(text: str) -> List[str]:
    """Return messages about files of a URDF that RViz will not find; the web is not checked."""
    packages = rospkg.RosPack()
    lacking: 'Counter[str]' = Counter()
    others: List[str] = []
    for uri in _uris(text):
        scheme, _, rest = uri.partition('://')
        path = resource_path(uri, packages)
        if scheme == 'package' and not path:
            lacking[rest.partition('/')[0]] += 1
        elif scheme not in _ON_THE_WEB and not os.path.isfile(path):
            others.append(f'"{uri}": ' + (missing_file(path) if path else
                                          'RViz opens package:// and file:// only'))
    found = [f'{count} mesh{"" if count == 1 else "es"} of the model cannot be shown: '
             f'{package_advice(name, packages)}, or put its folder beside the model'
             for name, count in lacking.items()]
    found += [f'a mesh of the model cannot be shown: {it}' for it in others[:_MAX_LISTED]]
    more = len(others) - _MAX_LISTED
    return found + ([f'{more} more meshes of the model cannot be shown'] if more > 0 else [])


def packages_beside(model_file: str) -> Dict[str, str]:
    """Return the folders, by package name, of packages above a file or in a folder above it."""
    found: Dict[str, str] = {}
    for above in _above(model_file):
        for folder in (above, *_folders_in(above)):
            name = _package_name(folder)
            if name:
                found.setdefault(name, folder)
    return found


def _uris(text: str) -> List[str]:
    """Return the names of a URDF's meshes and textures, each once."""
    root = ElementTree.fromstring(text)
    names = (element.get('filename', '') for tag in ('mesh', 'texture')
             for element in root.iter(tag))
    return list(dict.fromkeys(filter(None, names)))


def _beside(uri: str, model_file: str, packages: rospkg.RosPack) -> Optional[str]:
    """Return the file of a URI or path beside a model; None if RViz finds it, or it is missing."""
    scheme, separator, rest = uri.partition('://')
    if separator and scheme == 'package':
        package, _, path = rest.partition('/')
        if resource_path(uri, packages):
            return None
        return _first_file(os.path.join(folder, unquote(path))
                           for folder in _folders_of(package, model_file))
    if separator and (scheme != 'file' or rest.startswith('/')):
        return None
    path = unquote(rest) if separator else uri
    places = [os.path.normpath(os.path.join(folder, path)) for folder in _above(model_file)]
    return _first_file(places) or places[0]


def _folders_of(package: str, model_file: str) -> Iterator[str]:
    """Yield possible folders of a package that is not installed, even without a package.xml."""
    for above in _above(model_file):
        if package in (os.path.basename(above), _package_name(above)):
            yield above
        yield os.path.join(above, package)
    yield from (folder for name, folder in packages_beside(model_file).items() if name == package)


def _first_file(paths: 'Iterator[str] | List[str]') -> Optional[str]:
    return next((it for it in paths if os.path.isfile(it)), None)


def _above(file: str) -> List[str]:
    """Return the folder of a file, and folders above it."""
    found = [os.path.dirname(os.path.abspath(file))]
    while len(found) < _LEVELS and os.path.dirname(found[-1]) != found[-1]:
        found.append(os.path.dirname(found[-1]))
    return found


def _folders_in(folder: str) -> List[str]:
    try:
        with os.scandir(folder) as entries:
            return sorted(it.path for it in entries if it.is_dir())
    except OSError:
        return []


def _package_name(folder: str) -> str:
    """Return the name of the package in a folder; '' if it is not a package."""
    try:
        with open(os.path.join(folder, 'package.xml'), encoding='utf-8', errors='replace') as file:
            named = _PACKAGE_NAME.search(file.read())
    except OSError:
        return ''
    return named[1] if named else ''
