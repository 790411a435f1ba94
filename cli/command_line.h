// The words of the program at the terminal.
#pragma once

namespace limber::cli {

// Parses the arguments, runs the subcommand, prints, and answers the exit code. Throws nothing.
int run_command_line(int argc, const char* const* argv);

}  // namespace limber::cli
