# SPDX-License-Identifier: BSD-3-Clause
# Shared by ./demo and ./run_tests: installs what is missing, builds a catkin workspace outside of the
# source tree, and loads its environment. Sourced by bash; the repository is in $repository.

cache="${XDG_CACHE_HOME:-$HOME/.cache}/process_visualizer"
workspace="$cache/workspace-$(printf %s "$repository" | sha256sum | cut -c1-12)"
venv="$cache/venv"
noetic=/opt/ros/noetic/setup.bash

listed() { grep -h -v -e '^#' -e '^$' "$@"; }

# The files that name Debian's packages: those of all releases, those of this one.
apt_files() {
  local release
  release=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  ls "$repository/requirements/apt.txt" "$repository/requirements/apt-$release.txt" 2>/dev/null || true
}

apt() {
  if [ "$(id -u)" = 0 ]; then DEBIAN_FRONTEND=noninteractive apt-get "$@"
  else sudo DEBIAN_FRONTEND=noninteractive apt-get "$@"; fi
}

install_packages() {
  if [ -f "$noetic" ]; then
    rosdep check --from-paths "$repository" --ignore-src >/dev/null 2>&1 ||
      rosdep install --from-paths "$repository" --ignore-src -y
    return
  fi
  local missing
  # shellcheck disable=SC2046
  missing=$(comm -23 <(listed $(apt_files) | sort) \
    <(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' | sed -n 's/^ii  *//p' | sort -u))
  [ -n "$missing" ] || return 0
  missing=${missing//$'\n'/ }
  echo "installing: $missing"
  # shellcheck disable=SC2086
  apt update -q && apt install -q -y --no-install-recommends $missing || {
    echo "the packages could not be installed; as root: apt-get install --no-install-recommends $missing"
    return 1
  } >&2
}

install_python() {
  local stamp="$venv/installed.txt"
  cmp -s "$repository/requirements/python.txt" "$stamp" && return
  echo "installing Python packages into $venv"
  # Not recreated: running programs would miss the packages of the system for a moment.
  [ -x "$venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$venv"
  "$venv/bin/pip" install -q -r "$repository/requirements/python.txt"
  cp "$repository/requirements/python.txt" "$stamp"
}

# The dependencies of the build, including its options here; Python modules are used in place.
build_inputs() {
  (cd "$repository" && find .clang-tidy scripts/workspace.sh CMakeLists.txt package.xml setup.py cmake \
    compatibility env-hooks include msg nodes \
    src srv sewing_cell test/cpp *.xml -type f \
    -not -name '*.py' -not -path '*/meshes/*' -not -path '*/__pycache__/*' 2>/dev/null |
    sort | xargs sha256sum; cd "$repository" && sha256sum setup.py sewing_cell/setup.py)
}

build() {
  local inputs
  inputs=$(build_inputs)
  [ "$(cat "$workspace/built" 2>/dev/null)" = "$inputs" ] && return
  echo "building in $workspace"
  mkdir -p "$workspace/src"
  ln -sfn "$repository" "$workspace/src/process_visualizer"
  local log="$workspace/build.log"
  # Older versions of catkin use the first name for Python, those since Debian 13 the second.
  # Debian 11's cmake-extras has a GMock that is found at the first configuration only.
  if ! (cd "$workspace" && catkin_make -DPYTHON_EXECUTABLE="$venv/bin/python3" \
        -DPython_EXECUTABLE="$venv/bin/python3" -DCMAKE_DISABLE_FIND_PACKAGE_GMock=TRUE \
        -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON "$@" >"$log" 2>&1 &&
        catkin_make tests >>"$log" 2>&1); then
    tail -n 40 "$log"
    echo "the build failed; all of its output is in $log"
    return 1
  fi
  printf %s "$inputs" >"$workspace/built"
}

# The set-up files of catkin read variables that are not set.
load() {
  set +u
  # shellcheck disable=SC1090
  source "$1"
  set -u
}

# The network settings of ROS: prepare clears them, with all other variables of ROS.
keep_network() {
  named_master=${ROS_MASTER_URI:-}
  named_hostname=${ROS_HOSTNAME:-}
  named_ip=${ROS_IP:-}
}

restore_network() {
  [ -z "$named_master" ] || export ROS_MASTER_URI=$named_master
  [ -z "$named_hostname" ] || export ROS_HOSTNAME=$named_hostname
  [ -z "$named_ip" ] || export ROS_IP=$named_ip
}

# For what only reads the sources: nothing is built.
prepare_checkers() {
  export PATH="/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
  mkdir -p "$cache" "$workspace"
  exec 9>"$cache/lock"
  flock 9
  install_packages
  install_python
  exec 9>&-
  export PATH="$venv/bin:$PATH"
}

# Installs and builds under a lock, so that concurrent calls do not disturb each other.
prepare() {
  unset "${!ROS_@}" CMAKE_PREFIX_PATH PYTHONPATH
  export PATH="/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
  mkdir -p "$cache"
  exec 9>"$cache/lock"
  flock 9
  install_packages
  if [ -f "$noetic" ]; then load "$noetic"; fi
  install_python
  build
  exec 9>&-
  load "$workspace/devel/setup.bash"
  export PATH="$venv/bin:$PATH"
}
