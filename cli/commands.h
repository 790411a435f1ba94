// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include "limber/detail/commands.h"

namespace limber::cli {

using detail::Outcome;
using enum detail::ExitCode;

Outcome info(const fs::path& path);
Outcome list_scenes();

}  // namespace limber::cli
