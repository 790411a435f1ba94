// What commands print of a plan or a simulation in its work folder.
#pragma once

#include "cli/commands.h"
#include "limber/detail/plan/plan.h"

namespace limber::cli {

// `more`: lines of what this command alone can tell. Nothing of what a signal ended.
std::string text_of(const detail::KeptPlan&, const std::string& more = {});
// "from", where it begins in another folder, named `from`; else nothing.
std::string text_of_beginning(const detail::KeptPlan&, const fs::path& from);

Outcome outcome_of(const detail::KeptPlan&, const std::string& more = {});

}  // namespace limber::cli
