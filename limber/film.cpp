#include "limber/film.h"

#include "limber/detail/film/render.h"
#include "limber/detail/film/start.h"
#include "limber/detail/film/storyboard.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

using detail::working_for;

namespace {

void require_pictures(const FilmOptions& options) {
  if (options.bits != 8 && options.bits != 16)
    throw InputError(fmt::format("bits is {}; it must be 8 or 16", options.bits));
  for (const std::string& pass : options.passes) detail::require_one_of("pass", pass, pass_names);
}

}  // namespace

RenderedFilm render_film(const std::filesystem::path& folder, const FilmOptions& options,
                         const Context& context) {
  require_pictures(options);
  return working_for(context, [&] { return detail::render({options, folder}); });
}

PlannedFilm plan_and_render(const PlanOptions& plan, const FilmOptions& film, const Context& context) {
  require_pictures(film);
  return working_for(context, [&] { return detail::plan_and_film(plan, film); });
}

WrittenStill paint_still(const StillOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::render_still(options); });
}

WrittenStoryboard paint_storyboard(const StoryboardOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::write_storyboard(options); });
}

}  // namespace limber
