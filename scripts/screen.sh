# SPDX-License-Identifier: BSD-3-Clause
# Sourced by bash: a virtual screen and a master port for programs that must not disturb others.

work=$(mktemp -d)
screen_pid=

clean_up() {
  local pid
  for pid in "$@" $screen_pid; do
    kill "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
  done
  rm -rf "$work"
}

free_port() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])'
}

# usage: start_screen [WIDTHxHEIGHT]
start_screen() {
  local display
  mkfifo "$work/display"
  # In a session of its own: a Ctrl-C must reach the programs first, then end the screen.
  setsid Xvfb -displayfd 3 -screen 0 "${1:-1600x1000}x24" -nolisten tcp 3>"$work/display" 2>/dev/null &
  screen_pid=$!
  read -r display <"$work/display"
  ROS_MASTER_URI=http://localhost:$(free_port)
  export ROS_MASTER_URI DISPLAY=:$display LIBGL_ALWAYS_SOFTWARE=1 QT_X11_NO_MITSHM=1
}
