#!/usr/bin/env bash
# Builds the Debian packages, checks their contents, installs them into a root that contains only the shared libraries
# they depend on, runs the demo there, and removes them. Needs no network.
# Exit codes: 0 passed, 1 failed, 77 skipped.
# usage: package_test.sh SOURCE_FOLDER BUILD_FOLDER [ON: with the Python module]; the programs must be built. Needs root for chroot.
set -euo pipefail
export LC_ALL=C.UTF-8
source=$1
build=$2
with_python=${3:-}

fail() {
  printf 'failed: %s\n' "$@"
  exit 1
}
skip() {
  [[ -z ${YOUBOT_TESTS_MUST_RUN:-} ]] || fail "$1"
  echo "skipped: $1"
  exit 77
}
# nothing WHAT COMMAND...: fails with WHAT if the command prints anything.
nothing() {
  local output
  output=$("${@:2}" 2>&1) || true
  [[ -z $output ]] || fail "$1" "$output"
}

for tool in dpkg-deb dpkg-shlibdeps man lexgrog readelf; do
  command -v "$tool" >/dev/null || skip "$tool is missing: ./dev test installs it"
done
((EUID == 0)) || { echo 'skipped: chroot needs root'; exit 77; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# gzip, because xz takes 15 seconds.
cpack --config "$build/CPackConfig.cmake" -B "$scratch/packages" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip \
  >"$scratch/cpack" 2>&1 || fail "$(cat "$scratch/cpack")"
version=$("$build/bin/youbotd" --version)
version=${version%% *}
architecture=$(dpkg --print-architecture)
programs=$scratch/packages/youbot-hal_${version}_$architecture.deb
development=$scratch/packages/libyoubot-dev_${version}_$architecture.deb
documents=$scratch/packages/youbot-hal-doc_${version}_all.deb
python=$scratch/packages/python3-youbot_${version}_$architecture.deb

# unpack DEB FOLDER...: unpacks DEB into $files and checks that it has files in each of these folders and nowhere else.
unpack() {
  local folders
  files=$scratch/$(basename "$1" .deb)
  dpkg-deb --extract "$1" "$files"
  for folder in "${@:2}"; do [[ -e $files/$folder ]] || fail "$1 has no $folder"; done
  folders=$(printf '%s|' "${@:2}")
  nothing "$1 has files elsewhere" grep -Ev "^(${folders%|})(/|\$)" <(find "$files" -not -type d -printf '%P\n')
  nothing "$1 has files that not everybody can read, or anybody can write" find "$files" -perm /022 -o -not -perm -444
  # Only at the beginning of a path: the source folder may be as short as /src.
  nothing "$1 names folders of the machine that built it" \
    env LC_ALL=C grep -rlE "(^|[^[:alnum:]_.-])($source|$build)/" "$files"
}

unpack "$development" usr/include/youbot-hal usr/lib/libyoubot_{control,drivers,hal,identification,model,runtime,sim}.a \
  usr/lib/cmake/youbot usr/lib/pkgconfig/youbot.pc usr/share/doc/libyoubot-dev/copyright \
  usr/share/doc/youbot-hal/examples
# Its dependencies are packages that are installed here: this machine has just compiled with them.
dependencies=$(dpkg-deb --field "$development" Depends Recommends | sed 's/^[A-Z][a-z]*: //; s/([^)]*)//g; s/|[^,]*//g')
for package in ${dependencies//,/ }; do
  dpkg-query --show "$package" >/dev/null || fail "libyoubot-dev depends on $package"
done

if [[ -n $with_python ]]; then
  unpack "$python" usr/lib/python3/dist-packages usr/share/doc/python3-youbot/copyright usr/share/doc/youbot-hal/python
  PYTHONPATH=$files/usr/lib/python3/dist-packages /usr/bin/python3 -B "$files"/usr/share/doc/youbot-hal/python/examples/compensate_wheel.py |
    grep --quiet 'with compensation: wheel-1 turned [1-9]' || fail 'the Python module of the package does not drive a wheel'
fi

unpack "$documents" usr/share/doc/youbot-hal usr/share/doc/youbot-hal-doc/copyright
nothing "documents name programs or files of the source tree" \
  grep -rnE 'build/bin/youbot|apps/[a-z_]*/[a-z_]*\.toml' "$files"
links=0
while IFS=: read -r document link; do
  link=${link#*](}
  link=${link%%[)#]*}
  [[ -z $link || $link == http* || -e $(dirname "$document")/$link ]] || fail "$document: no $link"
  links=$((links + 1))
done < <(grep -roE '\]\([^)]+\)' "$files")
((links > 20)) || fail "only $links links in the documents"

unpack "$programs" usr/bin usr/lib/udev/rules.d usr/lib/systemd/system/youbotd.service usr/lib/sysusers.d/youbotd.conf \
  usr/share/man/man1 usr/share/bash-completion/completions usr/share/youbot-hal usr/share/doc/youbot-hal/copyright
for field in Depends=libc6 Section=science Maintainer='The youbot-hal authors' Description='KUKA youBot'; do
  [[ $(dpkg-deb --field "$programs" "${field%%=*}") == "${field#*=}"* ]] || fail "youbot-hal: no ${field/=/: }"
done
grep --quiet '^ExecStart=/usr/bin/youbotd ' "$files/usr/lib/systemd/system/youbotd.service" ||
  fail 'the unit names another youbotd'
for program in youbotd youbotctl youbot-bench youbot-sim youbot-gap; do
  binary=$files/usr/bin/$program
  page=$files/usr/share/man/man1/$program.1.gz
  completion=$files/usr/share/bash-completion/completions/$program
  nothing "$program is not stripped" grep '\.symtab' <(readelf --wide --sections "$binary")
  nothing "man finds mistakes in $program(1)" bash -c 'man --warnings=w --local-file "$0" >/dev/null' "$page"
  man --local-file "$page" >"$scratch/page"
  lexgrog "$page" | grep --quiet "\"$program - [a-z]" || fail "apropos would not find $program(1)"
  bash -uc 'source "$0"; complete -p "$1"' "$completion" "$program" >/dev/null || fail "no completion of $program"
  # All options in --help, of the program and of each command.
  commands=$("$binary" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p')
  for command in '' $commands; do
    offered=$(grep -F "  $command:-*)" "$completion")
    for option in $("$binary" $command --help | sed -nE 's/^  (-h,)?(--[a-z0-9-]+)[ ,].*/\2/p'); do
      grep -E --quiet -- "(^|[ ,])$option( |\$)" "$scratch/page" || fail "$program(1) lacks $option"
      [[ ${offered//\'/ } == *" $option "* ]] || fail "the completion of $program $command lacks $option"
    done
  done
done

# The root contains the libraries that ldd lists and dpkg's empty database. The package's scripts run outside of it,
# with DPKG_ROOT.
root=$scratch/root
mkdir -p "$root"/{etc,tmp} "$root"/var/lib/dpkg/{info,updates}
touch "$root/var/lib/dpkg/status"
ldd "$files"/usr/bin/* | grep -oE '/[^ ]+ \(0x' | sed 's/ (0x//' | sort -u >"$scratch/libraries"
while read -r library; do install -D "$library" "$root$library"; done <"$scratch/libraries"
# Lists all files except dpkg's database and the user database: a removed package leaves its user.
listing() {
  find "$root" -printf '%P\n' | grep -vE '^(var/lib/dpkg|etc/(passwd|group|shadow|gshadow|\.pwd\.lock))' | sort
}
listing >"$scratch/before"
in_root=(dpkg --root="$root" --log=/dev/null --force-depends --force-script-chrootless)
"${in_root[@]}" --install "$programs" "$development" "$documents" ${with_python:+"$python"} >"$scratch/dpkg" 2>&1 || fail "$(cat "$scratch/dpkg")"
if command -v systemd-sysusers >/dev/null; then
  grep --quiet '^youbot:' "$root/etc/passwd" || fail 'the package does not make the user youbot'
fi
demo=$(chroot "$root" /usr/bin/youbotd --config /usr/share/youbot-hal/demo.toml --demo --virtual-time 2>&1) || fail "$demo"
grep --quiet 'friction compensation' <<<"$demo" || fail 'the demo of the installed youbotd compares nothing' "$demo"
for program in youbotctl youbot-bench youbot-sim youbot-gap; do
  [[ $(chroot "$root" "/usr/bin/$program" --version) == "$version "* ]] || fail "the installed $program does not run"
done
"${in_root[@]}" --purge youbot-hal libyoubot-dev youbot-hal-doc ${with_python:+python3-youbot} >"$scratch/dpkg" 2>&1 || fail "$(cat "$scratch/dpkg")"
listing >"$scratch/after"
nothing 'a removed package leaves files' diff "$scratch/before" "$scratch/after"
echo passed
