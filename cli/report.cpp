#include "limber/detail/report/report.h"

#include <fmt/format.h>

#include "cli/commands.h"

namespace limber::cli {

namespace {

const char* words_of(detail::FilmInPage film) {
  switch (film) {
    case detail::FilmInPage::none:
      break;
    case detail::FilmInPage::embedded:
      return "embedded";
    case detail::FilmInPage::of_another_plan:
      return "left out: of another plan";
    case detail::FilmInPage::too_large:
      return "left out: large";
  }
  return "none";
}

}  // namespace

Outcome report(const fs::path& folder, const std::optional<fs::path>& file) {
  const detail::WrittenReport written = detail::report(folder, file);
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
