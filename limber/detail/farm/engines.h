// What runs the workers of a farm's folder: a scheduler, this machine, or whoever likes.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/farm/farm_folder.h"

namespace limber::detail {

// ---- Slurm: sbatch, squeue, scancel, where they are in PATH ----

bool slurm_is_there();

// farm/worker.sh, what each job runs.
std::string slurm_script(const FarmFolder&);

// The words of one sbatch for each job, of stages that are not done. A job waits for the one before it,
// however that ends, by its number, for which "$BEFORE" stands. The last one sees to all that is left.
std::vector<std::vector<std::string>> slurm_commands(const FarmFolder&);

// Writes the script, sends the jobs and keeps their numbers. Throws InputError with sbatch's own words.
void send_to_slurm(const FarmFolder&, int round);

// Of those that have not ended. Throws InputError where squeue does not answer.
std::vector<SlurmTask> slurm_tasks(const std::vector<std::string>& jobs);
void cancel_slurm(const std::vector<std::string>& jobs);

// ---- this machine ----

// Workers in processes of their own until all is done or fails, or the farm is cancelled; one that crashes is
// replaced. All end with this process. Throws InputError, DiskError, and Interrupted with what is done kept.
void run_here(const FarmFolder&);

// ---- Open Job Description (OpenJobDescription 2023-09): Deadline Cloud and others ----

std::string openjd_template(const FarmFolder&);

}  // namespace limber::detail
