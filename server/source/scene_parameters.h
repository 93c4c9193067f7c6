// What of a scene has a name and a value: every field, and every parameter of its solver, with unit, range
// and default, as one list for whoever asks. It is made of the lists that there are: scene_fields.h and the
// table of solvers. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"

namespace strandcast {

/// In the order of scene.proto.
std::vector<ParameterInfo> list_parameters(const SceneDesc& scene);

/// Whether a path begins with one of the prefixes, which commas part; all begin with an empty one.
bool begins_so(const std::string& path, const std::string& prefixes);

/// Those whose path begins so; of these at most kMaxListedParameters from the first-th on.
ParameterList list_of(const std::vector<ParameterInfo>& parameters, const ParameterRequest& request);

}  // namespace strandcast
