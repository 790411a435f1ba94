#include "cli/command_words.h"

#include <CLI/CLI.hpp>

#include <algorithm>

#include <fmt/ranges.h>

#include "limber/work_folder.h"
namespace limber::cli {

namespace {

std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.get_options())
    if (option->nonpositional()) options.push_back(option);
  return options;
}

std::vector<const CLI::Option*> positionals_of(const CLI::App& command) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.get_options())
    if (option->get_positional()) options.push_back(option);
  return options;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> commands_below(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands({})) names.push_back(one->get_name());
  return names;
}

bool takes_a_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// Of "TEXT:{lattice,fast}": those that may be said.
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}', begin);
  std::vector<std::string> words;
  if (begin == type.npos || end == type.npos) return words;
  for (std::size_t at = begin + 1; at < end;) {
    const std::size_t comma = std::min(type.find(',', at), end);
    words.push_back(type.substr(at, comma - at));
    at = comma + 1;
  }
  return words;
}

std::string value_name(const CLI::Option& option) {
  const std::vector<std::string> words = words_of(option);
  if (!words.empty()) return fmt::format("{}", fmt::join(words, "|"));
  std::string type = option.get_type_name();
  return type.substr(0, type.find(':'));
}

// Without what would end a word or a line in a shell's single quotes.
std::string quoted(std::string text, const std::string& apostrophe) {
  std::string safe;
  for (const char c : text) safe += c == '\'' ? apostrophe : c == '\n' ? " " : std::string(1, c);
  return "'" + safe + "'";
}

// ---- bash ----

std::string bash_completion(const CLI::App& program) {
  std::string cases, values;
  for (const CLI::App* command : all_commands(program)) {
    std::vector<std::string> words = commands_below(*command);
    for (const CLI::Option* option : options_of(*command)) {
      const std::vector<std::string> names = names_of(*option);
      words.insert(words.end(), names.begin(), names.end());
      const std::vector<std::string> said = words_of(*option);
      for (const std::string& name : names)
        if (takes_a_value(*option))
          values += fmt::format("    '{} {}') words='{}'; value=1 ;;\n", full_name(*command), name,
                                fmt::join(said, " "));
    }
    cases += fmt::format("    '{}') words='{}' ;;\n", full_name(*command), fmt::join(words, " "));
  }
  return fmt::format(R"(# limber {0}: for bash. Where it is not installed: source <(limber completion bash)
_limber_words() {{
  case "$1" in
{1}    *) return 1 ;;
  esac
}}
_limber_values() {{
  case "$1" in
{2}  esac
}}
_limber() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" command=limber words='' value=0 i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    if _limber_words "$command ${{COMP_WORDS[i]}}"; then command="$command ${{COMP_WORDS[i]}}"; fi
  done
  words=''
  _limber_values "$command ${{COMP_WORDS[COMP_CWORD-1]}}"
  if ((!value)); then
    _limber_words "$command"
    if [[ "$current" != -* && "$command" != limber && "$command" != 'limber scene' && "$command" != 'limber farm' ]]; then words=''; fi
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _limber limber
)",
                     library_version(), cases, values);
}

// ---- zsh ----

std::string zsh_text(std::string text) {
  std::string safe;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') safe += '\\';
    safe += c;
  }
  return safe;
}

std::string zsh_completion(const CLI::App& program) {
  std::string functions;
  for (const CLI::App* command : all_commands(program)) {
    std::string name = full_name(*command);
    std::replace(name.begin(), name.end(), ' ', '_');
    functions += fmt::format("_{}() {{\n", name);
    const std::vector<const CLI::App*> below = command->get_subcommands({});
    if (!below.empty()) {
      functions += "  local -a commands=(\n";
      for (const CLI::App* one : below)
        functions += fmt::format("    {}\n",
                                 quoted(zsh_text(one->get_name()) + ":" + one->get_description(), "'\\''"));
      functions += "  )\n";
    }
    functions += "  _arguments -s";
    for (const CLI::Option* option : options_of(*command)) {
      std::string value;
      if (takes_a_value(*option)) {
        const std::vector<std::string> words = words_of(*option);
        value = fmt::format(":{}:{}", zsh_text(value_name(*option)),
                            words.empty() ? "_files" : fmt::format("({})", fmt::join(words, " ")));
      }
      for (const std::string& one : names_of(*option))
        functions +=
            fmt::format(" \\\n    {}",
                        quoted("*" + one + "[" + zsh_text(option->get_description()) + "]" + value, "'\\''"));
    }
    if (below.empty()) {
      functions += " \\\n    '*:file:_files'\n}\n";
      continue;
    }
    functions += fmt::format(
        " \\\n    '1: :->command' '*::argument:->rest'\n  case $state in\n    command) _describe command "
        "commands ;;\n    rest) (( $+functions[_{0}_$words[1]] )) && _{0}_$words[1] ;;\n  esac\n}}\n",
        name);
  }
  return fmt::format(
      "#compdef limber\n# limber {}: for zsh. As a file _limber in a folder of $fpath.\n{}_limber "
      "\"$@\"\n",
      library_version(), functions);
}

// ---- fish ----

std::string fish_completion(const CLI::App& program) {
  std::string text =
      fmt::format("# limber {}: for fish. Where it is not installed: limber completion fish | source\n",
                  library_version());
  const auto condition = [&](const CLI::App& command) {
    std::string all;
    for (const CLI::App* one = &command; one != &program; one = one->get_parent())
      all = fmt::format("__fish_seen_subcommand_from {}{}{}", one->get_name(), all.empty() ? "" : "; and ",
                        all);
    return all;
  };
  for (const CLI::App* command : all_commands(program)) {
    const std::string where = condition(*command);
    const std::vector<std::string> below = commands_below(*command);
    if (!below.empty()) {
      std::string none_yet = fmt::format("not __fish_seen_subcommand_from {}", fmt::join(below, " "));
      if (!where.empty()) none_yet = where + "; and " + none_yet;
      for (const CLI::App* one : command->get_subcommands({}))
        text += fmt::format("complete -c limber -n {} -f -a {} -d {}\n", quoted(none_yet, "\\'"),
                            one->get_name(), quoted(one->get_description(), "\\'"));
    }
    for (const CLI::Option* option : options_of(*command)) {
      text += "complete -c limber";
      if (!where.empty()) text += fmt::format(" -n {}", quoted(where, "\\'"));
      for (const std::string& name : option->get_snames()) text += fmt::format(" -s {}", name);
      for (const std::string& name : option->get_lnames()) text += fmt::format(" -l {}", name);
      const std::vector<std::string> words = words_of(*option);
      if (!words.empty())
        text += fmt::format(" -x -a '{}'", fmt::join(words, " "));
      else if (takes_a_value(*option))
        text += " -r";
      text += fmt::format(" -d {}\n", quoted(option->get_description(), "\\'"));
    }
  }
  return text;
}

// ---- man ----

// Letters that roff would take for its own.
std::string roff(const std::string& text) {
  std::string safe;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool at_line = i == 0 || text[i - 1] == '\n';
    if (at_line && (c == '.' || c == '\'')) safe += "\\&";
    if (c == '\\')
      safe += "\\e";
    else if (c == '-')
      safe += "\\-";
    else
      safe += c;
  }
  return safe;
}

std::string page_name(const CLI::App& command) {
  std::string name = full_name(command);
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

}  // namespace

std::string full_name(const CLI::App& command) {
  return command.get_parent() ? full_name(*command.get_parent()) + " " + command.get_name()
                              : command.get_name();
}

std::vector<const CLI::App*> all_commands(const CLI::App& program) {
  std::vector<const CLI::App*> all{&program};
  for (const CLI::App* command : program.get_subcommands({})) {
    const std::vector<const CLI::App*> below = all_commands(*command);
    all.insert(all.end(), below.begin(), below.end());
  }
  return all;
}

std::string manual_file(const CLI::App& command) { return page_name(command) + ".1"; }

std::string completion_of(const CLI::App& program, const std::string& shell) {
  return shell == "bash"  ? bash_completion(program)
         : shell == "zsh" ? zsh_completion(program)
                          : fish_completion(program);
}

std::string manual_of(const CLI::App& program, const CLI::App& command) {
  std::string title = page_name(command);
  for (char& c : title) c = char(std::toupper(static_cast<unsigned char>(c)));
  std::string what = command.get_description();
  if (const std::size_t colon = what.find(": "); &command == &program && colon != what.npos)
    what = what.substr(colon + 2);
  std::string text = fmt::format(
      ".TH {} 1 \"\" \"limber {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B {}\n",
      roff(title), library_version(), roff(page_name(command)), roff(what), roff(full_name(command)));
  const std::vector<const CLI::App*> below = command.get_subcommands({});
  if (!below.empty()) text += ".I COMMAND\n";
  for (const CLI::Option* option : positionals_of(command))
    text += fmt::format(".I {}{}\n", roff(option->get_name(true)),
                        option->get_items_expected_max() > 1 ? " …" : "");
  text += "[\\fIOPTION\\fR …]\n";
  if (!below.empty()) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* one : below)
      text += fmt::format(".TP\n.B {}\n{}; see\n.BR {} (1)\n", roff(one->get_name()),
                          roff(one->get_description()), roff(page_name(*one)));
  }
  if (!positionals_of(command).empty()) text += ".SH ARGUMENTS\n";
  for (const CLI::Option* option : positionals_of(command))
    text += fmt::format(".TP\n.I {}\n{}\n", roff(option->get_name(true)), roff(option->get_description()));
  text += ".SH OPTIONS\n";
  for (const CLI::Option* option : options_of(command)) {
    text += fmt::format(".TP\n\\fB{}\\fR", roff(fmt::format("{}", fmt::join(names_of(*option), ", "))));
    if (takes_a_value(*option)) text += fmt::format(" \\fI{}\\fR", roff(value_name(*option)));
    text += fmt::format("\n{}\n", roff(option->get_description()));
    if (takes_a_value(*option) && !option->get_default_str().empty())
      text += fmt::format("Default: {}.\n", roff(option->get_default_str()));
  }
  text +=
      ".SH EXIT STATUS\n0 done; 1 a defect of limber, or a promise that is not kept; 2 bad input or usage; 3 "
      "no "
      "plan reached the goal (the best is kept); 4 frames failed; 5 the disk failed; 6 some of many models "
      "failed; 130 and 143 stopped by a signal, with all finished work kept.\n"
      ".SH ENVIRONMENT\n.TP\n.B LIMBER_SCENES\nfolder of the scenes that come with limber\n"
      ".TP\n.B LIMBER_MODELS\nfolder in which models of scenes are looked for\n"
      ".TP\n.B LIMBER_STORE\nfolder of prepared bodies, as\n.B \\-\\-store\nsays\n.SH SEE ALSO\n";
  std::vector<std::string> others;
  for (const CLI::App* one : all_commands(program))
    if (one != &command) others.push_back(fmt::format(".BR {} (1)", roff(page_name(*one))));
  return text + fmt::format("{}\n", fmt::join(others, ",\n"));
}

}  // namespace limber::cli
