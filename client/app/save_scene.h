// Scenes of a running server, kept as scene files.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"

namespace strandcast {

/// What the server sent, checked like a scene file. Pure.
Result<SceneDesc> scene_of(const SceneText& text);
/// The server's scene with what is seen now.
Result<SceneDesc> scene_of(const SceneText& text, const LookDesc& look, const CameraDesc& camera);

/// Writes the text of a scene, in a folder that is made where there is none; a file of this name is replaced.
Status save_scene(const std::filesystem::path& path, const std::string& text);

}  // namespace strandcast
