// What the command line takes, for manuals and for shells that complete it: all from its one description.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace limber::cli {

inline const std::vector<std::string> shells_completed{"bash", "zsh", "fish"};

// A script of that shell, one of shells_completed, that completes commands, options and their words.
std::string completion_of(const CLI::App& program, const std::string& shell);

// A page for man(1) of `command`, which is `program` or below it; "limber scene new" is limber-scene-new.
std::string manual_of(const CLI::App& program, const CLI::App& command);

// limber-scene-new.1
std::string manual_file(const CLI::App& command);

// The program, and all commands below it that take options, in order.
std::vector<const CLI::App*> all_commands(const CLI::App& program);
// "limber", "limber scene new".
std::string full_name(const CLI::App& command);

}  // namespace limber::cli
