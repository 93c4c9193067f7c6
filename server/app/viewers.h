// Viewers: who watches what, and which pictures have to be drawn for them. Network thread; the counts may be
// read from any thread.
#pragma once

#include <atomic>
#include <map>

#include "common/base/result.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"
#include "server/encode/picture_views.h"
#include "server/net/net_server.h"

namespace strandcast {

class Viewers {
 public:
  /// What a joining session gets.
  struct Place {
    StreamMode mode = StreamMode::Strands;
    std::string reason;  // of the mode, for a person
    PictureClass picture_class = 0;
    RenderSize size;
  };

  explicit Viewers(const SceneDesc& scene) : scene_(scene) {}

  /// A Source gets a place too, without any stream. LimitExceeded when too many different pictures are asked
  /// for, BadInput for a size that cannot be drawn.
  Result<Place> add(SessionId session, const Hello& hello);
  void remove(SessionId session);
  /// The viewer's new picture class; NotFound for a session without pictures.
  Result<PictureClass> set_camera(SessionId session, const CameraDesc& camera);

  /// The class of its strand frames; it joins with class 0. Ignored when the session is gone.
  void set_strand_class(SessionId session, uint16_t stream_id);
  /// How many watch strands of this class.
  uint32_t strand_viewers(uint16_t stream_id) const;

  std::map<uint32_t, PictureView> picture_views() const { return views_.views(); }
  RuntimeFacts facts() const;

 private:
  struct Viewer {
    Role role = Role::Viewer;
    StreamMode mode = StreamMode::Strands;
    uint16_t strand_class = 0;
    PictureView view;
  };
  void count();

  const SceneDesc scene_;
  std::map<SessionId, Viewer> viewers_;
  PictureViews views_;
  std::atomic<uint32_t> strand_viewers_{0};
  std::atomic<uint32_t> frame_viewers_{0};
};

}  // namespace strandcast
