// Scene files: protobuf text against proto/strandcast/v1/scene.proto, validated into a SceneDesc. Unknown
// fields, wrong types and values out of range are errors with file, line and column (or the field's path).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr uint64_t kMaxSceneFileBytes = 1u << 20;

/// Loads a scene; relative paths in it start at the file's folder. `overrides` are "path=value" pairs applied
/// before validation, for example "stream.bound_m=0.0005" or "colliders.0.radius_m=0.1"; relative paths in
/// them start at the current folder. The owner of the solver table checks the solver's name and parameters.
Result<SceneDesc> load_scene(const std::filesystem::path& path, const std::vector<std::string>& overrides);

/// Parses scene text; `place` names it in errors.
Result<SceneDesc> parse_scene(const std::string& text, const std::string& place,
                              const std::vector<std::string>& overrides);

/// Parses the text of a scene that ran, which says all: what its quality stands for is what it was then.
Result<SceneDesc> parse_recorded_scene(const std::string& text, const std::string& place);

/// Returns the built-in scene with overrides applied.
Result<SceneDesc> built_in_scene_with(const std::vector<std::string>& overrides);

/// Returns a scene with overrides applied and validated, for changes while running.
Result<SceneDesc> with_overrides(const SceneDesc& scene, const std::vector<std::string>& overrides);

/// Returns the scene as protobuf text, which parse_scene() reads back to an equal SceneDesc.
std::string to_text(const SceneDesc& scene);
/// Returns the scene as text in one line, for messages.
std::string to_line(const SceneDesc& scene);
/// Returns the scene with absolute paths, so that it can be saved anywhere; relative ones start at the
/// current folder.
SceneDesc with_absolute_paths(SceneDesc scene);
/// Returns look and camera as the text of a scene whose other fields keep their defaults.
std::string to_text(const LookDesc& look, const CameraDesc& camera);

}  // namespace strandcast
