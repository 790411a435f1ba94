// What commands print of a plan or a simulation in its work folder.
#pragma once

#include <functional>
#include <string>

#include "cli/commands.h"

namespace limber::cli {

// "from", where it begins in another folder, named `from`; else nothing.
std::string text_of_beginning(const Json& summary, const fs::path& from);

// `more`: lines of what this command alone can tell of the summary. No text of what a signal ended.
Outcome outcome_of(const KeptPlan&, const std::function<std::string(const Json& summary)>& more = {});

}  // namespace limber::cli
