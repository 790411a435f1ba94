// The program from its first word to its exit code: parses, runs the command that was given, prints, and
// turns what is thrown into an exit code and a sentence.
//
// With --json stdout has one document, also after a failure and where the words are wrong. Of a misspelt word
// it is said what was probably meant. The commands are described in files of their own
// (described_commands.h).
#include "cli/command_line.h"

#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <new>

#include "cli/described_commands.h"
#include "core/error.h"
#include "core/events.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "core/words.h"

namespace limber::cli {

namespace {

void print(const Outcome& outcome, bool json) {
  const std::string text = json ? text_of(outcome.json, 2) + "\n" : outcome.text;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw DiskError("stdout: writing the result failed");
}

// The first word that is no command or option, and what was meant, or that a command is missing; else what
// CLI11 complains of.
std::string what_is_wrong(const CLI::App& program, int argc, const char* const* argv,
                          const std::string& complaint) {
  const auto told = [](const std::string& word, const std::string& what,
                       const std::vector<std::string>& known, const char* help) {
    const std::string meant = nearest(word, known);
    return fmt::format(
        "{} is no {}; {}", word, what,
        meant.empty() ? fmt::format("see {} --help", help) : fmt::format("did you mean {}?", meant));
  };
  const CLI::App* command = &program;
  std::string name = "limber";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    std::vector<std::string> known;
    if (word.starts_with("--")) {
      for (const CLI::Option* option : command->get_options())
        for (const std::string& long_name : option->get_lnames()) known.push_back("--" + long_name);
      const std::string option = word.substr(0, word.find('='));
      if (std::find(known.begin(), known.end(), option) == known.end())
        return told(option, "option of " + name, known, name.c_str());
      continue;
    }
    const std::vector<const CLI::App*> commands = command->get_subcommands({});
    if (word.starts_with("-") || commands.empty()) continue;
    for (const CLI::App* one : commands) known.push_back(one->get_name());
    const auto found = std::find(known.begin(), known.end(), word);
    if (found == known.end()) return told(word, "command of " + name, known, name.c_str());
    command = commands[std::size_t(found - known.begin())];
    name += " " + word;
  }
  std::vector<std::string> commands;
  for (const CLI::App* one : command->get_subcommands({})) commands.push_back(one->get_name());
  const bool sets = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--set"; });
  if (commands.empty() && sets && complaint.find('=') != complaint.npos)
    return fmt::format("{}; each KEY=VALUE wants a --set of its own", complaint);
  if (commands.empty()) return fmt::format("{}; see {} --help", complaint, name);
  return fmt::format("{} needs a command, one of {}; see {} --help", name, fmt::join(commands, ", "), name);
}

// What is named must have a name: an empty one, as of a variable of a script that is not set, would be taken
// for this folder, or for nothing.
void refuse_empty_names(CLI::App& command) {
  for (CLI::Option* option : command.get_options())
    if (option->get_positional() || option->check_lname("out"))
      option->check([](const std::string& word) {
        return word.empty() ? std::string("is empty; give a name (a variable that is not set?)") : "";
      });
  for (CLI::App* one : command.get_subcommands({})) refuse_empty_names(*one);
}

// To people on stderr, to who listens to --progress as the last event, and with --json as the document.
int report_failure(int code, const std::string& what, bool json) {
  log::warn("limber: {}", what);
  events::tell({{"event", "end"}, {"exit_code", code}, {"error", what}});
  if (json) fmt::print("{}\n", text_of(Json{{"error", what}, {"exit_code", code}}, 2));
  return code;
}

}  // namespace

// Words first, then the work. CLI11 throws for help and version, too; those end with 0.

int run_command_line(int argc, const char* const* argv) {
  log::set_up(0);
  install_stop_signals();

  CLI::App program{"limber: plans the motion of soft things among soft things, and films it"};
  program.name("limber");
  program.set_version_flag("--version", "limber " + library_version());
  program.require_subcommand(1);
  program.footer(
      "Exit codes: 0 done; 1 a defect of limber; 2 bad input or usage; 3 no plan reached the goal (the best "
      "is kept);\n"
      "4 frames failed; 5 the disk failed; 6 some of many models failed; 130 and 143 stopped by a signal, "
      "with all finished work kept.");
  DescribedCommands commands(program);
  commands.add_all();
  refuse_empty_names(program);
  const GlobalOptions& global = commands.global;

  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool wrong = error.get_exit_code() != int(CLI::ExitCodes::Success);
    if (!wrong) {
      program.exit(error);
      return exit_done;
    }
    const std::string why = what_is_wrong(program, argc, argv, error.what());
    fmt::print(stderr, "limber: {}\n", why);
    const bool json = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--json"; });
    if (json) fmt::print("{}\n", text_of(Json{{"error", why}, {"exit_code", exit_bad_input}}, 2));
    return exit_bad_input;
  }

  log::set_up(global.quiet ? -1 : global.verbose ? 1 : 0);
  if (global.quiet) set_progress_enabled(false);
  set_thread_count(global.threads);
  try {
    events::set_up(global.progress);
    const Outcome outcome = commands.chosen();
    events::tell({{"event", "end"}, {"exit_code", outcome.exit_code}});
    print(outcome, global.json);
    return outcome.exit_code;
  } catch (const InputError& error) {
    return report_failure(exit_bad_input, error.what(), global.json);
  } catch (const DiskError& error) {
    return report_failure(exit_disk, error.what(), global.json);
  } catch (const Interrupted& stop) {
    return report_failure(exit_signal + stop.signal_number, stop.what(), global.json);
  } catch (const fs::filesystem_error& error) {  // where it may not even be asked what is there
    return report_failure(exit_disk, fmt::format("{}: {}", error.path1().string(), error.code().message()),
                          global.json);
  } catch (const std::bad_alloc&) {
    return report_failure(exit_bad_input, not_enough_memory, global.json);
  } catch (const std::exception& error) {
    return report_failure(exit_defect, fmt::format("this is a defect of limber: {}", error.what()),
                          global.json);
  }
}

}  // namespace limber::cli
