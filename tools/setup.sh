#!/bin/sh
# Make .venv with everything from the lock; `make setup` calls this. Safe to run again at any time.
#
# Looks for Python 3.11 or newer and for the system libraries that Qt needs. On Debian and Ubuntu,
# root installs what is missing; anyone else is told the one command that does.
# PYTHON=/path/to/python chooses the interpreter.
set -eu
cd "$(dirname "$0")/.."

# Shared library and the Debian package that holds it, for drawing without a screen ...
OFFSCREEN='libGL.so.1 libgl1
libEGL.so.1 libegl1
libX11.so.6 libx11-6
libxkbcommon.so.0 libxkbcommon0
libdbus-1.so.3 libdbus-1-3
libfontconfig.so.1 libfontconfig1
libfreetype.so.6 libfreetype6
libglib-2.0.so.0 libglib2.0-0
libgthread-2.0.so.0 libglib2.0-0'

# ... and for a window on a Wayland or X display besides.
WINDOW='libwayland-client.so.0 libwayland-client0
libwayland-cursor.so.0 libwayland-cursor0
libwayland-egl.so.1 libwayland-egl1
libX11-xcb.so.1 libx11-xcb1
libxkbcommon-x11.so.0 libxkbcommon-x11-0
libxcb.so.1 libxcb1
libxcb-cursor.so.0 libxcb-cursor0
libxcb-glx.so.0 libxcb-glx0
libxcb-icccm.so.4 libxcb-icccm4
libxcb-image.so.0 libxcb-image0
libxcb-keysyms.so.1 libxcb-keysyms1
libxcb-randr.so.0 libxcb-randr0
libxcb-render.so.0 libxcb-render0
libxcb-render-util.so.0 libxcb-render-util0
libxcb-shape.so.0 libxcb-shape0
libxcb-shm.so.0 libxcb-shm0
libxcb-sync.so.1 libxcb-sync1
libxcb-util.so.1 libxcb-util1
libxcb-xfixes.so.0 libxcb-xfixes0
libxcb-xkb.so.1 libxcb-xkb1'

say() { printf '%s\n' "setup: $*" >&2; }
fail() { say "$@"; exit 1; }

is_root() { [ "$(id -u)" -eq 0 ]; }
has_apt() { command -v apt-get >/dev/null 2>&1; }

# Once; a mirror that does not answer need not be the one that is wanted.
apt_update() {
    [ -z "${updated:-}" ] || return 0
    DEBIAN_FRONTEND=noninteractive apt-get update -qq || say "apt-get update failed; trying all the same"
    updated=yes
}

apt_install() {
    say "installing system packages: $*"
    apt_update
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null ||
        fail "apt-get could not install: $*"
}

# --- Python ------------------------------------------------------------------------------------

# Each check runs the interpreter: a name on the path need not be one that works.
new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; }
makes_venvs() { "$1" -c 'import ensurepip, venv' >/dev/null 2>&1; }

find_python() {
    for candidate in ${PYTHON:-python3.13 python3.12 python3.11 python3}; do
        if new_enough "$candidate" && { [ -z "${1:-}" ] || "$1" "$candidate"; }; then
            echo "$candidate"
            return
        fi
    done
}

version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || echo "not there"; }

choose_python() {
    python=$(find_python makes_venvs)
    [ -z "$python" ] || return 0
    found=$(find_python)
    if [ -n "$found" ]; then # without venv: Debian and Ubuntu pack it apart
        packages="python$(version_of "$found")-venv"
        trouble="$found can't make virtual environments"
    else
        packages='python3.11 python3.11-venv'
        trouble="Python 3.11 or newer is needed; ${PYTHON:-python3} is $(version_of "${PYTHON:-python3}")"
    fi
    has_apt || fail "$trouble. Install Python 3.11, 3.12 or 3.13 with its venv module, then run this again."
    is_root || fail "$trouble. As root run: apt-get update && apt-get install $packages"
    # shellcheck disable=SC2086 # a list of packages
    apt_install $packages
    python=$(find_python makes_venvs)
    [ -n "$python" ] || fail "$trouble, also after installing $packages."
}

# --- System libraries --------------------------------------------------------------------------

# The packages of those libraries of the table $1 that can't be loaded.
missing_packages() {
    "$python" -c '
import ctypes, sys
missing = {}
for line in sys.argv[1].splitlines():
    library, package = line.split()
    try:
        ctypes.CDLL(library)
    except OSError:
        missing[package] = None
print(*missing)' "$1"
}

has_font() {
    find -L /usr/share/fonts /usr/local/share/fonts "${HOME:-/nonexistent}/.fonts" \
        "${HOME:-/nonexistent}/.local/share/fonts" \
        \( -name '*.[to]tf' -o -name '*.ttc' \) 2>/dev/null | grep -q .
}

# The release's own name for each package: the move to 64-bit times renamed some.
named_here() {
    for package in "$@"; do
        if apt-cache show "${package}t64" >/dev/null 2>&1; then echo "${package}t64"; else echo "$package"; fi
    done | tr '\n' ' '
}

look_for_libraries() {
    needed=$(missing_packages "$OFFSCREEN")
    has_font || needed="$needed fonts-dejavu-core"
    wanted=$(missing_packages "$WINDOW")
}

see_to_libraries() {
    look_for_libraries
    [ -n "$needed$wanted" ] || return 0
    if has_apt && is_root; then
        apt_update # before the names are looked up
        # shellcheck disable=SC2046,SC2086 # lists of packages
        apt_install $(named_here $needed $wanted)
        look_for_libraries
        [ -z "$needed$wanted" ] || say "still missing after apt-get: $needed $wanted"
    elif has_apt; then
        # shellcheck disable=SC2046,SC2086
        say "as root run: apt-get update && apt-get install -y $(named_here $needed $wanted)"
    else
        say "missing system libraries, by the names of their Debian packages: $needed $wanted"
    fi
    [ -z "$needed" ] || fail "Qt can't draw without: $needed. Install them and run this again."
    [ -z "$wanted" ] || say "a window needs: $wanted. Without them the console draws off-screen only."
}

# --- The environment ---------------------------------------------------------------------------

make_environment() {
    if ! new_enough .venv/bin/python || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
        say "making .venv with Python $(version_of "$python")"
        "$python" -m venv --clear .venv
    fi
    say "installing the locked packages"
    pip="env PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore .venv/bin/python -m pip install --quiet"
    $pip --require-hashes --only-binary :all: -r requirements-dev.lock
    $pip --no-deps --no-build-isolation --editable .
}

choose_python
[ "$(uname -s)" != Linux ] || see_to_libraries
make_environment
say "ready"
