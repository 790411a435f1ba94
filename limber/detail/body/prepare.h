// From options of `limber prepare` to what prepare_body takes.
#pragma once

#include "limber/detail/body/body_store.h"
#include "limber/detail/commands.h"

namespace limber::detail {

// Throws InputError where two of them exclude each other.
void require_agreeing(const PrepareOptions&);

PrepareSettings settings_of(const PrepareOptions&);

// The body's model is `file`, and named options.model. Throws InputError when it cannot be read.
BodySource source_of(const PrepareOptions&, const fs::path& file);

}  // namespace limber::detail
