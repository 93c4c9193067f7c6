#include "client/app/save_scene.h"

#include <system_error>

#include "common/base/file.h"
#include "common/scene/scene_file.h"

namespace strandcast {

Result<SceneDesc> scene_of(const SceneText& text) {
  return parse_scene(text.text, "the server's scene", {});
}

Result<SceneDesc> scene_of(const SceneText& text, const LookDesc& look, const CameraDesc& camera) {
  ASSIGN_OR_RETURN(SceneDesc scene, scene_of(text));
  scene.look = look;
  scene.camera = camera;
  return scene;
}

Status save_scene(const std::filesystem::path& path, const std::string& text) {
  if (path.empty()) return make_error(ErrorCode::BadInput, "name the file that the scene is to be saved as");
  if (std::error_code failure; path.has_parent_path()) {
    std::filesystem::create_directories(path.parent_path(), failure);
    if (failure) return at(path.string(), make_error(ErrorCode::BadInput, "{}", failure.message()));
  }
  // A file that is no scene was named by mistake.
  if (std::error_code failure; std::filesystem::exists(path, failure)) {
    const auto text_there = load_text(path, kMaxSceneFileBytes);
    if (!text_there || !parse_scene(*text_there, path.string(), {}))
      return at(path.string(),
                make_error(ErrorCode::BadInput, "is there already and is no scene: it stays as it is"));
  }
  return save_file(path, std::as_bytes(std::span(text)));
}

}  // namespace strandcast
