# SPDX-License-Identifier: BSD-3-Clause
# Shared by ./demo and ./run_tests: installs missing packages, builds a catkin workspace outside of
# the source tree, and loads its environment. Sourced by bash; the repository is in $repository.
#
# prepare            programs and tests
# prepare programs   without tests: quicker if nothing has been built
# prepare_checkers   builds nothing, for checkers that read only the sources
# build_sanitized    the tests with sanitizers, into the folder $sanitized

export HOME="${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}"  # env -i has none
cache="${XDG_CACHE_HOME:-$HOME/.cache}/process_visualizer"
workspace="$cache/workspace-$(printf %s "$repository" | sha256sum | cut -c1-12)"
venv="$cache/venv"
sanitized="$workspace/devel/lib/sanitized"
noetic=/opt/ros/noetic/setup.bash
what=tests

listed() { grep -h -v -e '^#' -e '^$' "$@"; }

# The files with the names of Debian packages: for all releases, for this one, for tests.
apt_files() {
  local release
  release=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  ls "$repository/requirements/apt.txt" "$repository/requirements/apt-$release.txt" 2>/dev/null || true
  [ "$what" = programs ] || echo "$repository/requirements/tests/apt.txt"
  [ -z "${with_browsers:-}" ] || echo "$repository/requirements/tests/browsers.txt"
}

python_files() {
  echo "$repository/requirements/python.txt"
  [ "$what" = programs ] || echo "$repository/requirements/tests/python.txt"
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
  local file stamp
  for file in $(python_files); do
    stamp=$venv/installed-$(realpath --relative-to "$repository/requirements" "$file" | tr / -)
    cmp -s "$file" "$stamp" && continue
    echo "installing Python packages into $venv"
    # Not recreated: running programs would briefly lack the packages of the system.
    [ -x "$venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$venv"
    "$venv/bin/pip" install -q -r "$file"
    cp "$file" "$stamp"
  done
}

# The dependencies of the build, including its options here; Python modules are used in place.
build_inputs() {
  (cd "$repository" && find .clang-tidy scripts/workspace.sh CMakeLists.txt package.xml setup.py cmake \
    compatibility env-hooks include msg nodes \
    src srv sewing_cell test/cpp *.xml -type f \
    -not -name '*.py' -not -path '*/meshes/*' -not -path '*/__pycache__/*' 2>/dev/null |
    sort | xargs sha256sum; cd "$repository" && sha256sum setup.py sewing_cell/setup.py)
}

# catkin_make would start no second compiler while the load is above the number of processors, which
# its own compilers cause. Only messages for C++ and Python are needed.
make_all() (
  testing=ON launcher=
  [ "$what" = tests ] || testing=OFF
  if command -v ccache; then launcher=ccache; fi
  export CCACHE_BASEDIR="$workspace"  # another clone has its own workspace, and compiles the same
  export ROS_LANG_DISABLE=geneus:genlisp:gennodejs
  # Older versions of catkin use the first name for Python, those since Debian 13 the second.
  # Debian 11's cmake-extras has a GMock that is found at the first configuration only.
  cd "$workspace" && catkin_make -j"$(nproc)" -DPYTHON_EXECUTABLE="$venv/bin/python3" \
    -DPython_EXECUTABLE="$venv/bin/python3" -DCMAKE_DISABLE_FIND_PACKAGE_GMock=TRUE \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCATKIN_ENABLE_TESTING=$testing \
    -DCMAKE_CXX_COMPILER_LAUNCHER=$launcher -DPROCESS_VISUALIZER_QUICK_BUILD=ON &&
    { [ $testing = OFF ] || make -C build -j"$(nproc)" tests; }
)

# usage: logged LOG COMMAND …   prints only the end of the output, and only if the command fails
logged() {
  local log=$1
  shift
  if ! "$@" >"$log" 2>&1; then
    tail -n 40 "$log"
    echo "the build failed; all of its output is in $log"
    return 1
  fi
}

# `built-programs` records the sources of the built programs, `built-tests` those of the tests.
build() {
  local inputs
  inputs=$(build_inputs)
  [ "$(cat "$workspace/built-$what" 2>/dev/null)" = "$inputs" ] && return
  echo "building in $workspace"
  mkdir -p "$workspace/src"
  ln -sfn "$repository" "$workspace/src/process_visualizer"
  rm -f "$workspace"/built-*
  logged "$workspace/build.log" make_all
  printf %s "$inputs" >"$workspace/built-programs"
  [ "$what" = programs ] || cp "$workspace/built-programs" "$workspace/built-tests"
}

build_sanitized() {
  exec 9>"$workspace/lock"
  flock 9
  logged "$workspace/sanitized.log" make -C "$workspace/build" -j"$(nproc)" sanitized
  exec 9>&-
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

# Installs missing packages, under a lock, so that concurrent calls do not disturb each other. Each
# workspace has a lock of its own for building: a checker does not wait for a build.
install_all() {
  unset "${!ROS_@}" CMAKE_PREFIX_PATH PYTHONPATH
  export PATH="/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
  mkdir -p "$cache" "$workspace"
  exec 9>"$cache/lock"
  flock 9
  install_packages
  if [ -f "$noetic" ]; then load "$noetic"; fi
  install_python
  exec 9>&-
}

prepare() {
  what=${1:-tests}
  install_all
  exec 9>"$workspace/lock"
  flock 9
  build
  exec 9>&-
  load "$workspace/devel/setup.bash"
  export PATH="$venv/bin:$PATH"
}

prepare_checkers() {
  what=checkers
  install_all
  export PATH="$venv/bin:$PATH"
}
