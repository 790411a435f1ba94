#include "limber/body_folder.h"

#include "core/error.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/prepare.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

using detail::require_in;
using detail::require_one_of;

namespace {

void require_exports(const std::vector<std::string>& formats, double density_kg_m3) {
  for (const std::string& format : formats) require_one_of("format", format, export_formats);
  require_in("density_kg_m3", density_kg_m3, 1e-6, 1e6);
}

}  // namespace

void require_agreeing(const ModelOptions& options) {
  if (options.concavity > 0 && options.threshold > 0)
    throw InputError("--concavity and --threshold are one bound in two units; leave one out");
  if (!options.only.empty() && (!options.exports.empty() || options.preview))
    throw InputError(
        "--only makes a part of a body, and --preview and --export show a whole one; leave one out");
  if (options.only == "shells" && options.mode != "lattice")
    throw InputError("--only shells makes no cage; leave --mode out");
  if (options.only == "cage" && options.exact)
    throw InputError("--only cage makes no shells; leave --exact out");
}

PreparedFolder prepare_folder(const ModelOptions& options, const Context& context) {
  detail::require_in_range(detail::settings_of(options));
  require_in("scale", options.scale, 1e-9, 1e9);
  require_one_of("only", options.only, {"", "shells", "cage"});
  require_exports(options.exports, options.density_kg_m3);
  detail::require_label_surfaces_in_range(options);
  return detail::working_for(context, [&] { return detail::prepare(options); });
}

ExportedBody export_body(const BodyExportOptions& options, const Context& context) {
  require_exports(options.formats, options.density_kg_m3);
  return detail::working_for(context, [&] { return detail::export_body_folder(options); });
}

}  // namespace limber
