#!/bin/bash
# Tests youbotd.service under the systemd of a guest that has just booted, as root. Stops at the first failure and
# prints the status and the journal of the service.
set -uo pipefail
export SYSTEMD_COLORS=0 SYSTEMD_URLIFY=0
trap 'echo "guest: the tests ended with code $?"' EXIT

service=youbotd
configuration=/etc/youbot-hal/youbotd.toml
capabilities=0000000000806000  # CAP_NET_RAW CAP_IPC_LOCK CAP_SYS_NICE, by their numbers

step() { echo "== $1"; }
fail() {
  echo "failed: $1"
  systemctl status --no-pager --full --lines=0 $service
  journalctl --sync
  journalctl --no-pager --output=cat --unit $service | tail -n 60
  exit 1
}
# expect WHAT WANTED FOUND
expect() { [[ $3 == "$2" ]] || fail "$1: '$3' instead of '$2'"; }
# wait_for WHAT COMMAND...: waits longer than any machine needs; the time is a failure limit, not a measurement.
wait_for() {
  local what=$1 until=$((SECONDS + 120))
  shift
  until "$@"; do
    ((SECONDS < until)) || fail "waited in vain for $what"
    sleep 0.2
  done
}
# as NAME COMMAND...: runs a command as this user, with the groups of the user.
as() { setpriv --reuid="$1" --regid="$1" --init-groups -- "${@:2}"; }

property() { systemctl show --value --property="$1" $service; }
tried_again() { (($(property NRestarts) >= $1)); }
is_back_after() { tried_again "$1" && systemctl --quiet is-active $service; }
shows() { [[ $(youbotctl status 2>/dev/null) =~ $1 ]]; }
# Whether the journal has a line with this text.
logged() { journalctl --sync && journalctl --unit $service | grep --quiet "$1"; }
# A field of /proc/$pid/status of the service.
process() { sed -n "s/^$1:[[:space:]]*//p" "/proc/$pid/status"; }
# The kernel's answer to a process of the service that opens the node MAJOR MINOR.
opened() {
  mknod /dev/node-of-test c "$1" "$2"
  (echo $BASHPID >"/sys/fs/cgroup/system.slice/$service.service/cgroup.procs" && : <>/dev/node-of-test) 2>&1
  rm /dev/node-of-test
}
# Enables, waits until the robot drives, stops. Repeats when the emulated processor was too slow for the loop (a fault).
drives_or_ended() { shows 'phase +running' || ! kill -0 "$commander" 2>/dev/null; }
drive_and_stop() {
  local attempt ended
  for attempt in 1 2 3 4 5; do
    as member youbotctl --quiet enable </dev/null &
    commander=$!
    wait_for 'a robot that drives' drives_or_ended
    as member youbotctl --quiet stop || fail 'stop'
    wait "$commander" && return
    ended=$?
    ((ended == 4)) || break
    as member youbotctl --quiet acknowledge || fail 'acknowledge'
  done
  fail "youbotctl enable ended with $ended"
}
driver() { sed -n "s/^ *\([0-9]*\) $1\$/\1/p" /proc/devices; }

step 'installed and started as the manual says'
mkdir -p "${configuration%/*}"
# The robot is simulated on an emulated processor: a tenth of the cycles, and long pauses are no fault.
sed -e 's/^period_s = .*/period_s = 0.01/' -e 's/^command_timeout_s = .*/command_timeout_s = 2.0/' \
  -e 's/^commander_timeout_s = .*/commander_timeout_s = 10/' \
  -e 's/^filter_cutoff_rad_per_s = .*/filter_cutoff_rad_per_s = 50/' -e 's/^step_s = .*/step_s = 2e-4/' \
  -e 's/^\(# \)\?tolerated_cycles = .*/tolerated_cycles = 1/' -e 's/^frame_timeout_s = .*/frame_timeout_s = 0.05/' \
  /usr/local/share/youbot-hal/demo.toml >$configuration
# Start and watchdog also need more time than on a real processor.
mkdir /etc/systemd/system/$service.service.d
printf '[Service]\nTimeoutStartSec=infinity\nWatchdogSec=15\n' >/etc/systemd/system/$service.service.d/patience.conf
systemd-sysusers || fail 'systemd-sysusers'
systemctl daemon-reload && systemctl --quiet enable --now $service || fail 'systemctl enable --now'

step 'systemctl returns when the service is ready'
expect 'systemctl is-active' active "$(systemctl is-active $service)"
expect 'status' 'drives off, waiting for commands' "$(property StatusText)"
youbotctl status || fail 'it does not answer'
! shows 'NOT REAL-TIME' || fail 'it was refused real time'

step 'user, rights, real time'
pid=$(property MainPID)
expect 'user' "$(id --user youbot)" "$(process Uid | cut -f 1)"
expect 'group' "$(id --group youbot)" "$(process Gid | cut -f 1)"
for set in Prm Eff Inh Amb Bnd; do expect "capabilities (Cap$set)" $capabilities "$(process Cap$set)"; done
expect 'no new privileges' 1 "$(process NoNewPrivs)"
expect 'mode of the filter of system calls' 2 "$(process Seccomp)"
# Real-time priority and policy: fields of a thread's stat after its name.
scheduling=$(sed 's/.*) //' "/proc/$pid"/task/*/stat | cut -d ' ' -f 38,39)
expect 'SCHED_FIFO threads with the priority of the configuration' 1 "$(grep --count '^80 1$' <<<"$scheduling")"
locked=$(process VmLck)
((${locked% kB} > 0)) || fail "memory is not locked: $locked"

step 'sandbox'
inside=/proc/$pid/root
[[ -e /home/member/letter && ! -e $inside/home/member ]] || fail 'it sees home directories'
! touch "$inside/etc/written" 2>/dev/null || fail 'it may write to /etc'
touch "$inside/var/lib/youbotd/written" || fail 'it may not write to /var/lib/youbotd'
expect '/var/lib/youbotd' 'drwxr-x--- youbot youbot' "$(stat --format='%A %U %G' /var/lib/youbotd)"

step 'haptic devices that are plugged in later, and no other device'
modprobe -a usbcore hid  # as the first device of each kind does
for name in usb_device hidraw; do
  expect "a node of $name" 'No such device' "$(opened "$(driver $name)" 0 | sed 's/.*: //')"
done
expect 'the kernel'\''s log' 'Operation not permitted' "$(opened 1 11 | sed 's/.*: //')"

step 'who may talk to it'
youbotctl --quiet status || fail 'not root'
as member youbotctl --quiet status || fail 'not a member of the group youbot'
said=$(as visitor youbotctl --quiet status 2>&1) && fail 'a user outside the group youbot has access'
[[ $said == *'ermission denied'* ]] || fail "another user is refused for another reason: $said"

step 'enable and stop'
drive_and_stop
shows 'phase +off' || fail 'still on'

step 'killed by a signal: started again, and waits disabled'
systemctl kill --kill-whom=main --signal=SEGV $service
wait_for 'a restart after a crash' is_back_after 1
shows 'phase +off' || fail 'it went on by itself'

step 'hangs: ended by the watchdog, and started again'
systemctl kill --kill-whom=main --signal=STOP $service
wait_for 'a restart by the watchdog' is_back_after 2
logged 'Watchdog timeout' || fail 'that was not the watchdog'
shows 'phase +off' || fail 'it went on by itself'

step 'stopped: ends by itself, and in time'
systemctl stop $service || fail 'systemctl stop'
expect 'result' success "$(property Result)"
expect 'exit code' 0 "$(property ExecMainStatus)"
logged 'ended after [0-9]* cycles' || fail 'it was ended'

step 'a mistake in the configuration: not tried again'
cp $configuration /tmp/right.toml
sed -i 's/^priority = /prioritet = /' $configuration
line=$(sed -n '/^prioritet/=' $configuration)
! systemctl start $service 2>/dev/null || fail 'it started'
expect 'state' failed/failed "$(property ActiveState)/$(property SubState)"
expect 'exit code' 2 "$(property ExecMainStatus)"
logged "youbotd.toml:$line" || fail "the journal does not name line $line of the file"

step 'recordings, when the configuration enables them'
cp /tmp/right.toml $configuration
sed -n -e 's/^\[Service\]/&\nExecStart=/p' -e 's|^ExecStart=.*|& --record-csv /var/lib/youbotd/recordings|p' \
  /usr/local/lib/systemd/system/$service.service >/etc/systemd/system/$service.service.d/override.conf
systemctl daemon-reload && systemctl start $service || fail 'it does not start with --record'
drive_and_stop
as member grep --quiet "^[0-9.]*,1," /var/lib/youbotd/recordings/run-*/base.csv || fail 'no recording that a member may read'

step 'no cable to the robot: tried again, until there is one'
sed -i 's/^robot = .*/robot = "ethercat:cable"/' $configuration
! systemctl restart $service 2>/dev/null || fail 'it started'
wait_for 'another try' tried_again 1
ip link add robot type veth peer name cable && ip link set robot up && ip link set cable up || fail 'no veth'
youbot-sim --quiet --interface robot --robot base &
# The robot opens once all slaves were in operation; whether they still are depends on the processor.
wait_for 'a robot on the bus' logged 'ethercat:cable is open'
