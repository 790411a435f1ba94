// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include "limber/detail/commands.h"
#include "limber/detail/exports/export_motion.h"
#include "limber/detail/verify/verify.h"

namespace limber::cli {

using detail::Outcome;
using enum detail::ExitCode;

Outcome export_motion(const detail::ExportOptions&);
Outcome info(const fs::path& path);
Outcome list_scenes();
Outcome report(const fs::path& folder, const std::optional<fs::path>& file = {});
Outcome verify(const detail::VerifyOptions&);

}  // namespace limber::cli
