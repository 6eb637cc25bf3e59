# shellcheck shell=bash
# Installs packages of Debian or Ubuntu; sourced by the scripts beside it, which say what they are (`script`), what is to
# be there in the end (`what`) and with which `packages`. Nothing is done where all of them are there. With `--list` they
# are printed.
# Where it may not install (neither root nor sudo without a password) it says what to type; in CI that is an error.
# Status 2: arguments that are not valid. 130: Ctrl-C.

if [ "$*" = --list ]; then
    printf '%s\n' "${packages[@]}"
    exit 0
fi

say() { echo "$script: $*"; }

# A program that answers Ctrl-C by a status of its own would let the script go on. A subshell needs this again.
end_at_ctrl_c() { trap 'exit 130' INT; }
end_at_ctrl_c

# For scripts that take nothing, or only the options in `takes`.
refuse_arguments() {
    [ "$#" -eq 0 ] && return
    say "$*: not valid (give ${takes:-}--list, or nothing)"
    exit 2
}

# Not here: the sentence, and an error only where the tests must not pass without it.
give_up() {
    say "$*"
    [ -z "${CI:-}" ] || exit 1
    exit 0
}

has_apt() { command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; }

install_packages() {
    end_at_ctrl_c
    there=$(dpkg-query --show --showformat '${db:Status-Status}:${Package}\n' "${packages[@]}" 2>/dev/null || true)
    wanted=()
    for package in "${packages[@]}"; do
        grep -qx "installed:$package" <<<"$there" || wanted+=("$package")
    done
    if [ "${#wanted[@]}" -eq 0 ]; then
        say "$what is there"
        exit 0
    fi

    command="apt-get install --no-install-recommends ${wanted[*]}"
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
            as_root=(sudo -n)
        else
            give_up "it may not install packages here; as root: apt-get update && $command"
        fi
    fi

    # One script at a time: apt waits for dpkg, but not for another one that reads the lists.
    if command -v flock >/dev/null; then
        exec 9<"${BASH_SOURCE[0]}"
        flock 9
    fi

    # A machine of CI is thrown away afterwards: there dpkg need not wait for the disk after each file.
    hasty=()
    [ -z "${CI:-}" ] || hasty=(-o Dpkg::Options::=--force-unsafe-io)

    log=$(mktemp)
    trap 'rm -f "$log"' EXIT
    apt() {
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get -q -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 "${hasty[@]}" "$@" 2>&1 9<&-
    }

    # One line for every 50 packages that are ready, so that minutes do not pass in silence.
    install() {
        apt install --yes --no-install-recommends "${wanted[@]}" | tee "$log" | awk '
            /^Need to get/ { print "  " $0; fflush() }
            /^Fetched/ { print "  " $0; fflush() }
            /^Setting up/ { if (++ready % 50 == 0) { print "  " ready " packages ready"; fflush() } }'
    }

    failed() {
        tail -n 20 "$log"
        give_up "apt-get could not install $what; by hand, as root: apt-get update && $command"
    }

    say "installing ${#wanted[@]} packages and what they need"
    # Lists that are too old name versions that are gone, on a bare machine there are none at all: then they are read again.
    if ! apt install --simulate --no-install-recommends "${wanted[@]}" >"$log" || ! install; then
        say "reading the package lists"
        apt update >"$log" || failed
        install || failed
    fi
    say "$what is there, after $SECONDS s"
}
