// plan.npz: the whole of a plan, so that a search can be resumed and a path be replayed and filmed.
// Entries: docs/planning.md.
#pragma once

#include "core/npz.h"
#include "plan/search.h"

namespace limber::plan {

// Layouts that there have been, by number. Files of all of them are read.
inline constexpr int first_sealed = 3;           // one hash stands over all entries
inline constexpr int first_without_timings = 4;  // nor costs: the same search, the same bytes
inline constexpr int newest_edition = 4;
inline constexpr int path_alone = 5;  // the same of a plan that keeps its path alone (Plan::left_out)

struct PlanFile {
  Plan plan;   // since first_without_timings without costs (plan/timings.h), in_flight, a time limit not
               // reached
  Json given;  // the caller's own: scene text, versions
  int edition = newest_edition;
  bool sealed() const { return edition >= first_sealed; }
};

// Beside the plan itself it holds a megabyte, whatever the number of nodes.
void write_plan(const fs::path&, const Plan&, const Json& given);
// Its entries, as write_plan has them; those of a former edition that was sealed, as it had them. The plan
// must outlive their rows.
NpzRows rows_of(const Plan&, const Json& given, std::optional<int> edition = {});
Npz npz_of(const Plan&, const Json& given, std::optional<int> edition = {});

// Throws InputError when the file is cut short, lacks an entry, contradicts itself, or was changed since it
// was written (its hashes are checked).
PlanFile read_plan(const fs::path&);

}  // namespace limber::plan
