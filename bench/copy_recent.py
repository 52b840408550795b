# SPDX-License-Identifier: BSD-3-Clause
"""How long it takes until what the recorder has in memory is a bag, beside rosbag's own library.

usage: bench/run copy_recent
"""
from depth import run_programs

run_programs(('copy_recent_benchmark',))
