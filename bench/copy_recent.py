# SPDX-License-Identifier: BSD-3-Clause
"""Time to write the messages in the recorder's memory as a bag, compared with rosbag's library.

usage: bench/run copy_recent
"""
from depth import run_programs

run_programs(('copy_recent_benchmark',))
