# SPDX-License-Identifier: BSD-3-Clause
"""How examples of properties are chosen, in the tests of all folders.

With ``CI=1``, which ``./run_tests`` sets, they are the same each time, so that a run judges the
sources and nothing else. Without it others are looked for each time.
"""
import os

from hypothesis import HealthCheck, settings

# How long an example takes, or is made, proves nothing. Where examples share a fixture, they may.
settings.register_profile(
    'any machine', deadline=None, derandomize=bool(os.environ.get('CI')),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large,
                           HealthCheck.function_scoped_fixture])
settings.load_profile('any machine')
