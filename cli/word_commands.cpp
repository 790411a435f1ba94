// The program's own words, for shells and for man: completion and man. Both are made from the description of
// the commands that the parser has (command_words.h), so they never tell of an option that is not there.
// Installed completions and manual pages are what these two commands print (cli/CMakeLists.txt).
#include <CLI/CLI.hpp>

#include "cli/command_words.h"
#include "cli/described_commands.h"
#include "core/error.h"
#include "core/file.h"
#include "core/words.h"

namespace limber::cli {

namespace {

Outcome manual(const CLI::App& program, const std::vector<std::string>& words) {
  const std::string wanted = words.empty() ? "limber" : fmt::format("limber {}", fmt::join(words, " "));
  std::vector<std::string> known;
  for (const CLI::App* command : all_commands(program)) {
    if (full_name(*command) == wanted) {
      const std::string page = manual_of(program, *command);
      return {exit_done, {{"page", page}}, page};
    }
    known.push_back(full_name(*command));
  }
  const std::string meant = nearest(wanted, known);
  throw InputError(fmt::format("{} is no command; {}", wanted,
                               meant.empty() ? "see limber --help" : "did you mean " + meant + "?"));
}

Outcome write_manual(const CLI::App& program, const fs::path& folder) {
  make_folder(folder);
  Json files = Json::array();
  for (const CLI::App* command : all_commands(program)) {
    const fs::path file = folder / manual_file(*command);
    write_file(file, manual_of(program, *command));
    files.push_back(file.string());
  }
  return {exit_done, {{"pages", files}}, fmt::format("{}: {} pages\n", folder.string(), files.size())};
}

}  // namespace

void DescribedCommands::add_word_commands() {
  CLI::App& completion_command =
      *program.add_subcommand("completion", "a script by which a shell completes limber's words");
  completion_command.add_option("SHELL", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember(shells_completed));
  add_global(completion_command, global);
  completion_command.callback([&] {
    chosen = [&] {
      const std::string script = completion_of(program, shell);
      return Outcome{exit_done, {{"script", script}}, script};
    };
  });

  CLI::App& man_command = *program.add_subcommand("man", "a page of the manual, for man -l -");
  man_command.add_option("COMMAND", command_words, "as plan, or scene new; none: of limber itself");
  man_command.add_option("-o,--out", pages, "write all pages into this folder")->type_name("DIR");
  add_global(man_command, global);
  man_command.callback([&] {
    chosen = [&] { return pages.empty() ? manual(program, command_words) : write_manual(program, pages); };
  });
}

}  // namespace limber::cli
