#include "limber/detail/interface/working_for.h"

#include "core/error.h"

namespace limber::detail {

void require_limber_itself(const Context& context, const std::string& command) {
  if (!is_at_terminal(context))
    throw InputError(fmt::format(
        "the program limber does this, which starts itself many times; run \"{}\" instead", command));
}

}  // namespace limber::detail
