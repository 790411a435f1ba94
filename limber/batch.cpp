#include "limber/batch.h"

#include "limber/detail/batch/prepare_many.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

bool is_of_many(const std::string& word) {
  std::error_code none;
  return word.starts_with('@') || std::filesystem::is_directory(word, none);
}

PreparedMany prepare_models(const BatchOptions& options, const Context& context) {
  detail::require_limber_itself(context, "limber prepare");
  return detail::working_for(context, [&] { return detail::prepare_many(options); });
}

}  // namespace limber
