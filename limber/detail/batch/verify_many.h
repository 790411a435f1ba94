// The promises of a folder of many bodies that limber prepare made.
#pragma once

#include "limber/detail/verify/verify.h"

namespace limber::detail {

// Whether limber prepare has made many models there.
bool holds_many(const fs::path& folder);

// A row for each model that manifest.jsonl tells of: each promise of its body's folder, what is broken by
// name; and that manifest.jsonl and manifest.csv tell of those folders. Models that failed, and bodies that
// the manifest does not tell of, are found. Throws InputError for what can be asked of a single body or a
// plan alone.
Verified verify_many(const VerifyOptions&);

}  // namespace limber::detail
