# Slurm: a controller and a node with two processors on this machine, all of whose files lie in out/cluster/slurm-site.
site=$PWD/slurm-site
mkdir -p "$site/state" "$site/spool"
user=$(id -un)
node=$(hostname -s)
ports=($(python3 -c 'import socket; s = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]; print(*(a.getsockname()[1] for a in s))'))
# After a requeue Slurm waits as long as a credential holds, two minutes if not told.
cat > "$site/slurm.conf" <<END
ClusterName=twobounce
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=${ports[0]}
SlurmdPort=${ports[1]}
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$site/munge.socket,cred_expire=5
StateSaveLocation=$site/state
SlurmdSpoolDir=$site/spool
SlurmctldPidFile=$site/slurmctld.pid
SlurmdPidFile=$site/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,bf_interval=1
SlurmdParameters=config_overrides
KillWait=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES State=UP
END
export SLURM_CONF=$site/slurm.conf
head -c 1024 /dev/urandom > "$site/munge.key"
chmod 400 "$site/munge.key"

daemons=()
stop_slurm() {
  scancel --user "$user" 2>/dev/null || true
  kill "${daemons[@]}" 2>/dev/null || true
  wait "${daemons[@]}" 2>/dev/null || true
}
trap stop_slurm EXIT
PATH="$PATH:/usr/sbin"
munged --force --foreground --key-file="$site/munge.key" --socket="$site/munge.socket" --pid-file="$site/munge.pid" --seed-file="$site/munge.seed" \
  > "$site/munged.log" 2>&1 &
daemons+=($!)
until [ -S "$site/munge.socket" ]; do sleep 0.1; done
slurmctld -D > "$site/slurmctld.log" 2>&1 &
daemons+=($!)
slurmd -D > "$site/slurmd.log" 2>&1 &
daemons+=($!)
for _ in $(seq 300); do [ "$(sinfo -h -o %t 2>/dev/null)" = idle ] && break; sleep 0.1; done
[ "$(sinfo -h -o %t)" = idle ] || { tail "$site"/*.log >&2; exit 1; }

# The first part is requeued as if its node had failed, and comes back by itself; the others are killed.
harm() {
  local job
  if [ -e requeued ]; then kill -9 "$1"; return; fi
  job=$(tr '\0' '\n' < "/proc/$1/environ" | sed -n 's/^SLURM_JOB_ID=//p')
  scontrol requeue "$job"
  echo "$job" > requeued
}
engine "Slurm" slurm
grep -q "Requeuing JobId=.*($(cat slurm/requeued))" "$site/slurmctld.log"
