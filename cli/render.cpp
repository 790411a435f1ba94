#include <fmt/format.h>

#include "cli/kept_plan.h"
#include "core/json_fields.h"

namespace limber::cli {

namespace {

std::string text_of(const FilmTime& time) {
  std::string text = fmt::format(
      "{:.1f} s of film show {:.2f} s of the motion, at {}× its speed", time.seconds, time.motion_s,
      time.slowest == time.quickest ? fmt::format("{:.3g}", time.slowest)
                                    : fmt::format("{:.2g} to {:.2g}", time.slowest, time.quickest));
  if (time.left_out_s > 0)
    text +=
        fmt::format("; the last {:.2f} s, in which nothing is seen to move, are left out", time.left_out_s);
  return text + "\n";
}

std::string text_of(const RenderedFilm& film) {
  std::string text = fmt::format("{} of {} frames in {}: {} painted, {} kept, {} failed; {:.2f} CPU s\n",
                                 film.wanted, film.frames, film.folder.string(), film.painted,
                                 film.wanted - film.painted - film.failed, film.failed, film.cpu_s) +
                     text_of(film.time);
  const auto [width, height] = film.size;
  if (film.film)
    text += fmt::format("film {}{}, contact sheet {}\n", film.film->string(),
                        width % 2 + height % 2 == 0 ? ""
                                                    : fmt::format(" ({}x{}: films have even sides)",
                                                                  width + width % 2, height + height % 2),
                        film.sheet->string());
  else if (film.failed == 0)
    text += "no film yet: not all frames are there\n";
  if (film.others > 0)
    text +=
        fmt::format("{} of the frames that are there show it by other options than these; render all anew\n",
                    film.others);
  if (film.old_film)
    text += fmt::format("{} is of an earlier render, and not of these frames\n", film.old_film->string());
  return text;
}

int exit_code_of(const RenderedFilm& film) { return film.failed == 0 ? exit_done : exit_frames_failed; }

}  // namespace

Outcome render(const fs::path& folder, const FilmOptions& options) {
  const RenderedFilm film = render_film(folder, options, at_terminal());
  return {exit_code_of(film), json_of_fields(film), text_of(film)};
}

Outcome run(const PlanOptions& plan_options, const FilmOptions& film_options) {
  const auto [kept, film] = plan_and_render(plan_options, film_options, at_terminal());
  Outcome both = outcome_of(kept);
  if (kept.up_to_date) both.text.clear();
  if (film.failed > 0) both.exit_code = exit_code_of(film);
  both.text += text_of(film);
  both.json = {{"plan", both.json}, {"render", json_of_fields(film)}};
  return both;
}

}  // namespace limber::cli
