#!/usr/bin/env bash
# Proves the SLURM array and the Snakemake profile on a real SLURM: one node, this machine, with its daemons started by hand. The
# tables are those of `satphot run` byte for byte, also after tasks killed at work and submitted again. Needs root on Debian 12
# or a kin of it, the network (Debian packages, Snakemake from PyPI) and 2 GB of free memory; installs slurm-wlm and munge where
# they are not. Refuses to touch a machine that has a slurm.conf. About 6 minutes.
# usage: scripts/prove_slurm.sh FOLDER SATPHOT
set -euo pipefail
usage="usage: prove_slurm.sh FOLDER SATPHOT"
folder=$(mkdir -p "${1:?$usage}" && cd "$1" && pwd)
satphot=$(cd "$(dirname "${2:?$usage}")" && pwd)/$(basename "$2")
here=$(cd "$(dirname "$0")/.." && pwd)
conf=/etc/slurm/slurm.conf # where sbatch and the Snakemake plugin, which clears SLURM_CONF, look for it
[ "$(id -u)" = 0 ] || { echo "prove_slurm.sh needs root" >&2; exit 1; }
if [ -e "$conf" ] && ! grep -q '^ClusterName=satphotproof$' "$conf"; then
    echo "$conf is there: this machine has a SLURM of its own" >&2
    exit 1
fi

# ---- install
if ! command -v slurmctld >/dev/null || ! command -v munged >/dev/null || ! command -v python3 >/dev/null; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends slurm-wlm munge python3-venv >"$folder/apt.log" 2>&1
fi
venv=$folder/venv
if [ ! -x "$venv/bin/snakemake" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install -q "snakemake>=9,<10" "snakemake-executor-plugin-slurm>=2,<3"
fi

# ---- one node: its own munge socket and key, ports that differ from those of a usual SLURM
state=$(mktemp -d)
chmod 755 "$state"
shut_down() {
    set +e
    scancel --user=root 2>/dev/null
    scontrol shutdown 2>/dev/null
    sleep 2
    for daemon in slurmctld slurmd munged; do
        [ -s "$state/$daemon.pid" ] && kill "$(cat "$state/$daemon.pid")" 2>/dev/null
    done
    rm -f "$conf"
    mkdir -p "$folder/daemons" && cp "$state"/*.log "$folder/daemons/" 2>/dev/null
    rm -rf "$state"
    echo "SLURM stopped"
}
trap shut_down EXIT
mkdir "$state/slurmctld" "$state/slurmd"
(umask 077 && head -c 1024 /dev/urandom >"$state/munge.key")
munged --socket="$state/munge.socket" --key-file="$state/munge.key" --log-file="$state/munged.log" \
    --pid-file="$state/munged.pid" --seed-file="$state/munged.seed"
node=$(hostname -s)
cores=$(slurmd -C | sed -n 's/.* CPUs=\([0-9]*\).*/\1/p')
memory=$(slurmd -C | sed -n 's/.* RealMemory=\([0-9]*\).*/\1/p')
mkdir -p "$(dirname "$conf")"
cat >"$conf" <<END
ClusterName=satphotproof
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$state/munge.socket
StateSaveLocation=$state/slurmctld
SlurmdSpoolDir=$state/slurmd
SlurmctldPidFile=$state/slurmctld.pid
SlurmdPidFile=$state/slurmd.pid
SlurmctldLogFile=$state/slurmctld.log
SlurmdLogFile=$state/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=sched_min_interval=100000,batch_sched_delay=0
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
MinJobAge=300
NodeName=$node NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$memory State=UNKNOWN
PartitionName=short Nodes=$node Default=YES MaxTime=60 State=UP
END
slurmctld
slurmd
for _ in $(seq 100); do
    [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
    sleep 0.2
done
[ "$(sinfo -h -o %T)" = idle ] || { echo "the node did not come up" >&2; tail -n 20 "$state"/slurm*.log >&2; exit 1; }
echo "$(sinfo --version), one node of $cores cores; Snakemake $("$venv/bin/snakemake" --version)," \
    "its plugin $("$venv/bin/pip" list 2>/dev/null | sed -n 's/^snakemake-executor-plugin-slurm  *//p')"

# ---- two nights by satphot run
cd "$folder"
rm -rf bin stub one two out array results .snakemake satphot_*.log slurm-*.out snakemake.log signal.log
mkdir bin
ln -s "$satphot" bin/satphot
export PATH=$folder/bin:$PATH # the jobs inherit it
for night in one two; do
    [ "$night" = one ] && seed=1 || seed=7
    satphot simulate -q -o "$night" --seed "$seed" --set "name=$night" --set frame.nx_px=320 --set frame.ny_px=240 \
        --set target.n=20 >/dev/null 2>&1
    satphot run -q --no-figures "$night/pipeline.toml" -o out >/dev/null
done
same() { # FOLDER NIGHT WHAT
    for table in photometry.ecsv residuals.ecsv stars.ecsv zeropoint.toml master_flat.fits; do
        cmp "out/$2/$table" "$1/$table"
    done
    echo "same bytes: $3"
}

# ---- the array, by the lines of slurm_array.sh
array=$here/scripts/snakemake/slurm_array.sh
state_of() { scontrol -o show job "$1" | sed -n 's/.*JobState=\([A-Z]*\).*/\1/p' | sort | uniq -c | tr -s ' \n' ' '; }
wait_for() { # JOB
    for _ in $(seq 600); do
        [ -z "$(squeue -h -j "$1" 2>/dev/null)" ] && return
        sleep 0.2
    done
    echo "job $1 does not end" >&2
    exit 1
}
merge='satphot merge --plan array/plan.json array/shards/*.ecsv -o array/photometry.ecsv'
satphot plan -q -c one/pipeline.toml --frames-per-shard 5 -o array/plan.json >/dev/null
satphot flat -q --plan array/plan.json -o array/master_flat.fits >/dev/null
satphot zeropoint -q --plan array/plan.json -o array/zeropoint.toml >/dev/null
last=$(python3 -c 'import json; print(len(json.load(open("array/plan.json"))["shards"]) - 1)')
job=$(sbatch --parsable --array=0-"$last" "$array" array)
merged=$(sbatch --parsable --dependency=afterok:"$job" --wrap "$merge")
wait_for "$merged"
echo "array of $((last + 1)) tasks:$(state_of "$job")merge:$(state_of "$merged")"
same array one "SLURM array"

killed() { # WHAT SCANCEL_OPTIONS...: task 2 killed while it works, until it was in time; then submitted again by its number
    local what=$1
    shift
    for _ in $(seq 20); do
        rm -rf array/shards/2.* array/shards/.satphot array/photometry.ecsv array/residuals.ecsv
        job=$(sbatch --parsable --array=2 "$array" array)
        for _ in $(seq 2000); do # until it has kept a frame
            [ -n "$(find array/shards/.satphot -name 'target-*' 2>/dev/null)" ] && break
            sleep 0.005
        done
        scancel "$@" "${job}_2"
        wait_for "$job"
        [ -e array/shards/2.ecsv ] || break
    done
    [ ! -e array/shards/2.ecsv ] || { echo "$what: never in time" >&2; exit 1; }
    local kept=$(find array/shards/.satphot -name 'target-*' | wc -l)
    local was code=0
    was=$(state_of "$job")
    satphot merge -q --plan array/plan.json array/shards/*.ecsv -o array/photometry.ecsv >/dev/null 2>&1 || code=$?
    [ "$code" = 3 ] && [ ! -e array/photometry.ecsv ]
    job=$(sbatch --parsable --array=2 "$array" array)
    merged=$(sbatch --parsable --dependency=afterok:"$job" --wrap "$merge")
    wait_for "$merged"
    echo "$what:$was$kept of 5 frames kept, merge without it: exit code $code; submitted again:$(state_of "$job")" \
        "$(grep -o '"frames_kept": [0-9]*' array/shards/2.json)"
    same array one "$what and submitted again"
}
killed "task killed with -9" --signal=KILL --batch
killed "task cancelled by scancel"

# ---- signal before the end of the time: to the program, not only to steps it does not have
mkdir -p stub
printf '#!/bin/bash\ntrap "echo stopped by TERM after \$SECONDS s; exit 143" TERM\nwhile sleep 0.2; do :; done\n' >stub/satphot
chmod +x stub/satphot
job=$(PATH=$folder/stub:$PATH sbatch --parsable --time=2 --cpus-per-task=1 --array=0 --output=signal.log "$array" array)
wait_for "$job"
seconds=$(sed -n 's/.*TERM after \([0-9]*\) s.*/\1/p' signal.log)
[ "${seconds:-999}" -lt 110 ] || { echo "no signal before the end of the time: $(cat signal.log)" >&2; exit 1; }
echo "time limit 120 s: TERM came after $seconds s"

# ---- two nights by Snakemake with the profile; account and partition from the line, no accounting database here
snake() {
    "$venv/bin/snakemake" -s "$here/scripts/snakemake/Snakefile" --profile "$here/scripts/snakemake/profiles/slurm" "$@" \
        --default-resources "slurm_partition='short'" mem_mb=1000 runtime=20 --slurm-status-command squeue \
        --slurm-init-seconds-before-status-checks 2 --seconds-between-status-checks 2 --latency-wait 10 --config \
        'nights={"one": "one/pipeline.toml", "two": "two/pipeline.toml"}' out=results frames_per_shard=5 mem_mb=1000 >>snakemake.log 2>&1
}
SECONDS=0
snake || { tail -n 40 snakemake.log >&2; exit 1; }
echo "two nights by Snakemake: $(grep -c 'has been submitted with SLURM jobid' snakemake.log) SLURM jobs, $SECONDS s"
for night in one two; do same "results/$night" "$night" "$night by Snakemake on SLURM"; done
rm results/two/{shards/1.ecsv,photometry.ecsv,report.html}
snake || { tail -n 40 snakemake.log >&2; exit 1; }
same results/two two "Snakemake on SLURM, a shard lost and measured again"
echo "all proved"
