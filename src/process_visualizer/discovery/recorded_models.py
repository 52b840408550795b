# SPDX-License-Identifier: BSD-3-Clause
"""The models in the configuration that a recording was made with."""
from __future__ import annotations

import tempfile
from typing import List, Tuple

from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Device, Model
from process_visualizer.cell.provenance import Origin, Provenance
from process_visualizer.cell.stored_configuration import StoredConfiguration, write_configuration
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.descriptions.robot_description import (
    ModelError,
    load_robot_description,
    model_path,
)
from process_visualizer.discovery.found_model import FoundModel

_REASON = 'as in the configuration of the recording'


def recorded_models(recording: Recording) -> Tuple[List[FoundModel], List[str]]:
    """Return the models of a recording's configuration, and why others cannot be used."""
    configuration = recorded_configuration(recording)
    if configuration is None:
        return [], []
    models: List[FoundModel] = []
    remarks = ['The recording holds the configuration that it was made with: "cell configuration" '
               'writes it.']
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        for device, model in _devices(configuration, folder, remarks):
            try:
                models.append(_found(device, model))
            except ModelError as error:
                remarks.append(f'The model of {device.name} cannot be used: {error}')
    return models, remarks


def _devices(configuration: StoredConfiguration, folder: str,
             remarks: List[str]) -> List[Tuple[Device, Model]]:
    try:
        path = write_configuration(configuration, folder)
        cell = XmlParser(configuration.arguments,
                         Provenance(Origin.BAG, folder)).parse(path)
    except (OSError, ConfigurationError) as error:
        remarks.append(f'That configuration cannot be read: {error}')
        return []
    return [(device, device.model) for device in cell.devices if device.model is not None]


def _found(device: Device, model: Model) -> FoundModel:
    description = load_robot_description(model_path(model), model.arguments,
                                         confined_to=model.confined_to)
    if not model.package:
        return FoundModel(f'/{device.name}', device.name, description, reason=_REASON,
                          prefix=model.prefix)
    return FoundModel(f'/{device.name}', device.name, description, model.package, model.path,
                      _REASON, model.arguments, model.prefix)
