#include "limber/body_folder.h"

#include "core/error.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/prepare.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

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
  return detail::working_for(context, [&] { return detail::prepare(options); });
}

ExportedBody export_body(const BodyExportOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::export_body_folder(options); });
}

}  // namespace limber
