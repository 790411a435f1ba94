#include "limber/work_folder.h"

#include <algorithm>

#include "core/error.h"
#include "core/json_text.h"
#include "limber/detail/batch/verify_many.h"
#include "limber/detail/exports/export_motion.h"
#include "limber/detail/interface/problem.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"
#include "limber/detail/report/report.h"
#include "limber/detail/verify/verify.h"

namespace limber {

using detail::working_for;

namespace detail {
namespace {

Verified verify_any(const VerifyOptions& options) {
  return holds_many(options.folder) ? verify_many(options) : detail::verify(options);
}

}  // namespace
}  // namespace detail

std::vector<Promise> verify(const std::filesystem::path& folder, const std::string& scene,
                            const Context& context) {
  return working_for(context, [&] {
    VerifyOptions options;
    options.folder = folder, options.scene.scene = scene;
    return detail::verify_any(options).promises.rows();
  });
}

std::vector<Promise> verify(const std::filesystem::path& folder, const Scene& scene, const Context& context) {
  return working_for(context, [&] {
    VerifyOptions options;
    options.folder = folder;
    const Scene::Impl& of = scene.impl();
    return detail::verify(options, detail::TrustedScene{of.scene.name, of.scene, of.data}).promises.rows();
  });
}

Verdict verify(const VerifyOptions& options, const Context& context) {
  detail::require_in("repaint", options.repaint, 1, 1'000'000);
  return working_for(context, [&] {
    const detail::Verified found = detail::verify_any(options);
    return Verdict{found.promises.all_kept(), found.promises.rows(), found.promises.measured(),
                   found.motion ? text_of(detail::json_of(*found.motion), 2) : "", found.scene};
  });
}

std::vector<Promise> verify_body(const std::filesystem::path& folder, const std::filesystem::path& model,
                                 const Context& context) {
  return working_for(context, [&] {
    VerifyOptions options;
    options.folder = folder, options.model = model;
    return detail::verify(options).promises.rows();
  });
}

ExportedMotion export_motion(const ExportOptions& options, const Context& context) {
  if (options.formats.empty()) throw InputError("no format is named; there are gltf, pc2, usd, vtu");
  for (const std::string& format : options.formats)
    if (std::find(motion_formats.begin(), motion_formats.end(), format) == motion_formats.end())
      throw InputError(fmt::format("there is no format \"{}\"; there are gltf, pc2, usd, vtu", format));
  return working_for(context, [&] { return detail::export_motion(options); });
}

std::vector<std::filesystem::path> export_motion(const std::filesystem::path& folder,
                                                 const std::vector<std::string>& formats,
                                                 const std::filesystem::path& out, const Context& context) {
  ExportOptions options;
  options.folder = folder, options.formats = formats;
  if (!out.empty()) options.out = out;
  const ExportedMotion exported = export_motion(options, context);
  std::vector<std::filesystem::path> files;
  for (const std::string& format : formats)
    for (const auto& [name, written] : exported.formats)
      if (name == format) files.push_back(written.open);
  return files;
}

WrittenReport write_report(const std::filesystem::path& folder,
                           const std::optional<std::filesystem::path>& file, const Context& context) {
  return working_for(context, [&] { return detail::report(folder, file); });
}

}  // namespace limber
