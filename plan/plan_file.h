// plan.npz: the whole of a plan, so that a search can be resumed and a path be replayed and filmed.
// Entries: docs/planning.md.
#pragma once

#include "core/npz.h"
#include "plan/search.h"

namespace limber::plan {

struct PlanFile {
  Plan plan;
  Json given;           // the caller's own: scene text, versions
  bool sealed = false;  // one hash stood over all entries; not in files of former formats
};

void write_plan(const fs::path&, const Plan&, const Json& given);
// Its entries, as write_plan has them.
Npz npz_of(const Plan&, const Json& given);

// Throws InputError when the file is cut short, lacks an entry, contradicts itself, or was changed since it
// was written (its hashes are checked).
PlanFile read_plan(const fs::path&);

}  // namespace limber::plan
