#include "limber/work_folder.h"

#include <algorithm>

#include "core/error.h"
#include "limber/detail/exports/export_motion.h"
#include "limber/detail/film/render.h"
#include "limber/detail/interface/working_for.h"
#include "limber/detail/report/report.h"
#include "limber/detail/verify/verify.h"

namespace limber {

using detail::working_for;

std::vector<Promise> verify(const std::filesystem::path& folder, const std::string& scene,
                            const Context& context) {
  return working_for(context, [&] {
    detail::VerifyOptions options;
    options.folder = folder, options.scene.scene = scene;
    return detail::verify(options).promises.rows();
  });
}

std::vector<Promise> verify_body(const std::filesystem::path& folder, const std::filesystem::path& model,
                                 const Context& context) {
  return working_for(context, [&] {
    detail::VerifyOptions options;
    options.folder = folder, options.model = model;
    return detail::verify(options).promises.rows();
  });
}

Film render_film(const std::filesystem::path& folder, const FilmOptions& options, const Context& context) {
  return working_for(context, [&] {
    detail::RenderOptions command;
    command.folder = folder;
    command.frames = options.frames;
    command.resume = options.resume;
    if (options.width != 0 || options.height != 0)
      command.size = fmt::format("{}x{}", options.width, options.height);
    command.camera = options.camera, command.name = options.name, command.sets = options.sets;
    if (!options.video.empty()) command.video = options.video;
    const detail::RenderedFilm rendered = detail::render(command);
    return Film{rendered.film.value_or(""), int(rendered.painted), int(rendered.failed)};
  });
}

std::vector<std::filesystem::path> export_motion(const std::filesystem::path& folder,
                                                 const std::vector<std::string>& formats,
                                                 const std::filesystem::path& out, const Context& context) {
  return working_for(context, [&] {
    if (formats.empty()) throw InputError("no format is named; there are gltf, pc2, usd, vtu");
    for (const std::string& format : formats)
      if (std::find(detail::motion_formats.begin(), detail::motion_formats.end(), format) ==
          detail::motion_formats.end())
        throw InputError(fmt::format("there is no format \"{}\"; there are gltf, pc2, usd, vtu", format));
    detail::ExportOptions options;
    options.folder = folder, options.formats = formats;
    if (!out.empty()) options.out = out;
    const detail::ExportedMotion exported = detail::export_motion(options);
    std::vector<std::filesystem::path> files;
    for (const std::string& format : formats)
      for (const auto& [name, written] : exported.formats)
        if (name == format) files.push_back(written.open);
    return files;
  });
}

std::filesystem::path write_report(const std::filesystem::path& folder, const std::filesystem::path& file,
                                   const Context& context) {
  return working_for(context, [&] {
    std::optional<fs::path> to;
    if (!file.empty()) to = file;
    return detail::report(folder, to).file;
  });
}

}  // namespace limber
