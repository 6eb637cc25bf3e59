# shellcheck shell=bash
# Environments of judges, sourced by the scripts beside it: each judge has its own packages and its own Python.

# prepared NAME PYTHON PACKAGE…: installs packages for a Python of at least that version, and sets `judging` to it.
# Status 1, with a line that says why, where that cannot be.
prepared() {
    local name=$1 oldest=$2 environment=$PWD/build/judge-$1 python
    shift 2
    if [ "$(cat "$environment/.installed" 2>/dev/null)" != "$*" ]; then
        if ! python=$(python_since "$oldest"); then
            echo "skipped: $name; there is no Python $oldest or later; install one as python$oldest" >&2
            return 1
        fi
        rm -rf "$environment"
        "$python" -m venv "$environment"
        if ! "$environment/bin/pip" install --quiet --disable-pip-version-check "$@"; then
            echo "skipped: $name; its packages could not be installed (see above)" >&2
            return 1
        fi
        echo "$*" >"$environment/.installed"
    fi
    judging=$environment/bin/python
}

python_since() {
    local each
    for each in python3 python3.12 python3.13 python3.14 "$(pyenv root 2>/dev/null)"/versions/3.1[0-9].*/bin/python; do
        if "$each" -c "import sys; sys.exit(sys.version_info < tuple(map(int, '$1'.split('.'))))" 2>/dev/null; then
            echo "$each"
            return
        fi
    done
    return 1
}

# Some 5 GB: the only torch on the index is that for CUDA. Both judges of LeRobot share it.
prepared_lerobot() {
    prepared lerobot 3.12 'lerobot[dataset,evaluation]==0.6.1' -e adapters/cellwright_env -e adapters/lerobot_env_cellwright
}
