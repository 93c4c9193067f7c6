// Saves scenes of a running server as scene files.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Parses and checks the server's text like a scene file. Pure.
Result<SceneDesc> scene_of(const SceneText& text);
/// Returns the server's scene with the look and camera that are seen now.
Result<SceneDesc> scene_of(const SceneText& text, const LookDesc& look, const CameraDesc& camera);

/// Writes a scene's text; creates the folder if needed and replaces a file of this name.
Status save_scene(const std::filesystem::path& path, const std::string& text);

}  // namespace strandcast
