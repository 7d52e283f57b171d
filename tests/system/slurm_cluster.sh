#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A cluster of Slurm with one node, this machine, on loopback, all of it below one folder: slurm_cluster.sh FOLDER start|stop
# Exit code 77: Slurm is not installed, or this user may not run it.
set -euo pipefail
folder=$(realpath -m "$1")
conf=$folder/slurm.conf
export SLURM_CONF=$conf PATH=$PATH:/usr/sbin

stop() {
  for name in slurmd slurmctld munged; do
    [ -s "$folder/$name.pid" ] || continue
    kill "$(cat "$folder/$name.pid")" 2>/dev/null || true
    for _ in $(seq 50); do kill -0 "$(cat "$folder/$name.pid" 2>/dev/null)" 2>/dev/null || break; sleep 0.1; done
  done
}

start() {
  for program in munged slurmctld slurmd sbatch squeue; do
    command -v "$program" >/dev/null || { echo "no $program: ./dev setup --all installs Slurm" >&2; exit 77; }
  done
  [ "$(id -u)" = 0 ] || { echo "a node of Slurm takes root" >&2; exit 77; }
  mkdir -p "$folder"/{state,spool}
  chmod 755 "$folder"
  dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 status=none
  chmod 400 "$folder/munge.key"
  munged --force --key-file "$folder/munge.key" --socket "$folder/munge.socket" --pid-file "$folder/munged.pid" \
    --log-file "$folder/munged.log" --seed-file "$folder/munge.seed"
  # Debian's machines resolve their own name in /etc/hosts; the node is called localhost all the same.
  cat >"$conf" <<CONF
ClusterName=gyre
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=$3
SlurmdPort=$(($3 + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerType=sched/backfill
MpiDefault=none
CommunicationParameters=NoInAddrAny
ReturnToService=2
NodeName=localhost NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/{print int($2 / 1024 * 0.9)}' /proc/meminfo) State=UNKNOWN
PartitionName=all Nodes=localhost Default=YES MaxTime=INFINITE State=UP
CONF
  echo 'CgroupPlugin=cgroup/v1' >"$folder/cgroup.conf"
  slurmctld -f "$conf"
  slurmd -f "$conf" -N localhost
  for _ in $(seq 150); do
    sinfo -h -o %t 2>/dev/null | grep -q idle && exit 0
    sleep 0.2
  done
  tail -n 5 "$folder"/*.log >&2
  stop
  exit 1
}

case "$2" in
  start) start "$@" ;;
  stop) stop ;;
esac
