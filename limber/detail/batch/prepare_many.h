// Many models, each in a process of its own. docs/batch.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/batch/batch.h"
#include "limber/detail/batch/model_list.h"
#include "limber/detail/body/prepare.h"

namespace limber::detail {

double memory_share_mb(int jobs);  // three quarters of the machine's, shared by them

// Throws InputError, DiskError, and Interrupted with what is prepared kept.
PreparedMany prepare_many(const BatchOptions&);

// A part of it, beside others who make other parts in the same folder: some of options.listed, by their
// places. Tables and page are left to prepare_many(), which finds them done. `part` names a file of its
// journal.
PreparedMany prepare_part(const BatchOptions&, const std::string& part,
                          const std::vector<std::size_t>& which);

}  // namespace limber::detail
