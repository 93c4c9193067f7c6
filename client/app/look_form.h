// Builds a form from a look's fields with ranges and units, as common/scene/scene_fields.h lists them, so
// that new fields appear automatically. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "client/window/form.h"
#include "common/base/result.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Returns every field of the look, grouped by section.
std::vector<FormField> look_fields(const LookDesc& look);

/// Adds the edits that a person expects to come with the given ones: custom colours start from the colours
/// now seen.
std::vector<FormEdit> completed(const LookDesc& seen, std::vector<FormEdit> edits);

/// Returns the assignment "look={ ... }" that sets exactly these fields by SetParameter. There must be at
/// least one edit.
std::string look_assignment(const std::vector<FormEdit>& edits);

/// Returns the look after these edits, checked like a scene file.
Result<LookDesc> with_edits(const LookDesc& look, const std::vector<FormEdit>& edits);

}  // namespace strandcast
