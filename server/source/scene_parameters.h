// Lists every field of a scene and every parameter of its solver with value, unit, range and default. The
// list is made from scene_fields.h and the table of solvers. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Returns the parameters in the order of scene.proto. `quality_reason` says why that quality runs which
/// does, where the machine chose it.
std::vector<ParameterInfo> list_parameters(const SceneDesc& scene, const std::string& quality_reason = {});

/// Returns whether a path begins with one of the comma-separated prefixes; an empty prefix matches all.
bool begins_so(const std::string& path, const std::string& prefixes);

/// Returns the parameters whose path matches the request, at most kMaxListedParameters from its first index
/// on.
ParameterList list_of(const std::vector<ParameterInfo>& parameters, const ParameterRequest& request);

}  // namespace strandcast
