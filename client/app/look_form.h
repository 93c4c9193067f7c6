// A look as a form: the fields that common/scene/scene_fields.h has, with its ranges and units, so that a new
// one shows up by itself. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "client/window/form.h"
#include "common/base/result.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Every field of the look, those of one section together.
std::vector<FormField> look_fields(const LookDesc& look);

/// The same edits, with what a person expects of them: colours of one's own begin with those that are seen.
std::vector<FormEdit> completed(const LookDesc& seen, std::vector<FormEdit> edits);

/// "look={ ... }": what SetParameter takes to set these fields and no others. There must be one.
std::string look_assignment(const std::vector<FormEdit>& edits);

/// The look after these edits, checked like a scene file.
Result<LookDesc> with_edits(const LookDesc& look, const std::vector<FormEdit>& edits);

}  // namespace strandcast
