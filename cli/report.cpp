#include <fmt/format.h>

#include "cli/commands.h"

namespace limber::cli {

namespace {

const char* words_of(FilmInPage film) {
  switch (film) {
    case FilmInPage::none:
      break;
    case FilmInPage::embedded:
      return "embedded";
    case FilmInPage::of_another_plan:
      return "left out: of another plan";
    case FilmInPage::too_large:
      return "left out: large";
  }
  return "none";
}

}  // namespace

Outcome report(const fs::path& folder, const std::optional<fs::path>& file) {
  const WrittenReport written = write_report(folder, file, at_terminal());
  const char* const film = words_of(written.film);
  return {exit_done,
          {{"file", written.file.string()},
           {"bytes", written.bytes},
           {"all_kept", written.all_kept},
           {"film", film}},
          fmt::format("{} ({:.2f} MB; film: {}){}\n", written.file.string(), 1e-6 * double(written.bytes),
                      film, written.all_kept ? "" : "; not every promise is kept")};
}

}  // namespace limber::cli
