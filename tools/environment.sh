# Sourced by tools/test and tools/demo, from the root of the repository:
# `prepare_environment EXTRA...` makes .venv where it is missing, installs the package with these
# extras into it, and sets $python. In a sourced ROS 2 shell the system's rclpy is used instead
# of the wheels.

say() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; }

system_ros() { [ -n "${ROS_DISTRO:-}" ] && python3 -c 'import rclpy' 2>/dev/null; }

make_venv() {
    [ -x .venv/bin/python ] && .venv/bin/python -m pip --version >/dev/null 2>&1 && return
    python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' || {
        say 'needs python3 3.10 or newer'
        return 1
    }
    say 'making .venv'
    # Only a ROS 2 shell lends its packages; elsewhere the environment stands on its own.
    local options=()
    if system_ros; then options=(--system-site-packages); fi
    python3 -m venv --clear "${options[@]+"${options[@]}"}" .venv >/dev/null || {
        say 'cannot make .venv: install the package python3-venv (apt install python3-venv)'
        return 1
    }
}

install_extras() {
    local extras=$1 pins=()
    if system_ros; then
        extras=$(tr ',' '\n' <<<"$extras" | grep -vx ros | paste -sd, -)
        # The system's compiled messages work with the numpy they were built for only.
        pins=("numpy==$(python3 -c 'import numpy; print(numpy.__version__)')")
    fi
    # setup.py and pyproject.toml decide what is installed; the code itself is used in place.
    local stamp
    stamp=.venv/installed-$(cat setup.py pyproject.toml - <<<"$extras" | cksum | tr ' ' -)
    [ -e "$stamp" ] && return
    say "installing the package with [$extras] from PyPI: some minutes the first time"
    local attempt
    for attempt in 1 2; do
        if "$python" -m pip install -qq --disable-pip-version-check \
                --editable ".[$extras]" "${pins[@]+"${pins[@]}"}"; then
            touch "$stamp"
            return
        fi
        if [ "$attempt" = 1 ]; then say 'the installation failed, trying once more'; fi
    done
    say 'pip could not install the package: see its message above; is PyPI reachable?'
    return 1
}

prepare_environment() {
    make_venv || return
    python=$PWD/.venv/bin/python
    # Left over from another environment of ROS wheels, these keep this one's from starting.
    if ! system_ros; then unset _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH; fi
    install_extras "$(IFS=,; printf '%s' "$*")"
}
