#!/bin/bash
# 1,000 runs as an array of 16 tasks. Submit it, and merge when all tasks have ended:
#
#     job=$(sbatch --parsable slurm.sh)
#     sbatch --dependency=afterany:$job --wrap 'cellwright eval merge shards/* --min-score 75%'
#
# Submit some tasks once more, for the runs that are left: sbatch --array=3,7 slurm.sh
#SBATCH --job-name=evaluation
#SBATCH --array=1-16
#SBATCH --cpus-per-task=8
#SBATCH --mem-per-cpu=2500M
#SBATCH --time=02:00:00
#SBATCH --requeue
#SBATCH --open-mode=append

shards=16  # the last number of the array above

cellwright eval lesson --agent my_robot.py:MyRobot --vary --seeds 1000 --jobs "${SLURM_CPUS_PER_TASK:-1}" \
    --shard "auto/$shards" --out "shards/$SLURM_ARRAY_TASK_ID"
status=$?

# 75: the machine failed and runs are left. The task is queued again, and does those alone.
if [ "$status" -eq 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
fi
exit "$status"
