// Viewers: who watches what, and which pictures have to be drawn for them. Network thread; the counts may be
// read from any thread.
#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"
#include "server/app/mode_policy.h"
#include "server/encode/picture_ladder.h"
#include "server/encode/picture_views.h"
#include "server/net/net_server.h"

namespace strandcast {

/// At most one ModeRequest of a viewer is carried out in this time.
inline constexpr int64_t kModeRequestNs = 1'000'000'000;
/// A change whose first frame does not come in this time is given up.
inline constexpr int64_t kModeChangeNs = 20'000'000'000;

class Viewers {
 public:
  /// What a joining session gets.
  struct Place {
    StreamMode mode = StreamMode::Strands;
    std::string reason;  // of the mode, for a person
    PictureClass picture_class = 0;
    RenderSize size;
    // As in Admission, of a viewer of frames; it starts with the scene's quality.
    std::vector<double> picture_costs;
    size_t picture_step = 0;
  };
  /// What a viewer of frames gets.
  struct Pictures {
    PictureClass picture_class = 0;
    PictureView view;
  };

  explicit Viewers(const SceneDesc& scene);

  /// A Source gets a place too, without any stream. Unavailable while too many pictures are drawn for others,
  /// BadInput for a size that cannot be drawn.
  Result<Place> add(const Visitor& visitor, const Hello& hello);
  void remove(SessionId session);
  /// For the log: number, role and name.
  std::string describe(SessionId session) const;
  /// The new picture class of a viewer of frames; none for one of strands, whose camera is kept for later.
  /// NotFound for a session that views nothing.
  Result<std::optional<PictureClass>> set_camera(SessionId session, const CameraDesc& camera);

  /// What the viewer says of itself; the newest counts.
  void set_report(SessionId session, const ViewerReport& report);
  ViewerReport report(SessionId session) const;
  /// What the person wants; of requests within kModeRequestNs the newest counts.
  void request_mode(SessionId session, StreamMode mode);
  /// Call often: what to change for this session now, or what to tell it. The change is under way until
  /// set_mode().
  std::optional<ModeSwitch> consider(SessionId session, const ModeFacts& facts, int64_t time_ns);
  /// The session has got the first frame of this mode.
  void set_mode(SessionId session, StreamMode mode, int64_t time_ns);

  /// Moves the viewer along its ladder. NotFound for a session without pictures, Unavailable as in
  /// PictureViews; it then keeps what it had.
  Result<Pictures> set_picture_step(SessionId session, size_t step);
  /// Nothing for a session without pictures.
  std::optional<Pictures> pictures(SessionId session) const;

  /// The class of its strand frames; it joins with class 0. Ignored when the session is gone.
  void set_strand_class(SessionId session, uint16_t stream_id);
  /// How many watch strands of this class.
  uint32_t strand_viewers(uint16_t stream_id) const;
  /// The size of its pictures.
  RenderSize picture_size(SessionId session) const;

  std::map<uint32_t, PictureView> picture_views() const { return views_.views(); }
  RuntimeFacts facts() const;
  /// All who watch; facts() counts one whose mode changes for both.
  uint32_t viewer_count() const { return viewer_count_; }

 private:
  struct Viewer {
    Role role = Role::Viewer;
    std::string peer;
    std::string name;
    StreamMode wanted = StreamMode::Strands;  // may be Auto
    StreamMode mode = StreamMode::Strands;    // of the frames it gets
    std::optional<StreamMode> next;           // the change to this mode is under way
    int64_t next_since_ns = 0;
    uint16_t strand_class = 0;
    PictureView view;
    RenderSize size;  // of its pictures, at the first steps of
    std::vector<PictureStep> ladder;
    size_t step = 0;
    ViewerReport report;
    ModePolicy policy;
    std::optional<StreamMode> request;  // not yet looked at
    int64_t request_ns = 0;             // when the one before was; 0 = never
    bool is_answer_due = false;

    bool gets(StreamMode kind) const { return role != Role::Source && (mode == kind || next == kind); }
  };
  Result<PictureClass> assign_view(SessionId session, const Viewer& viewer, const PictureView& view);
  ModeChoice choose(Viewer& viewer, const ModeFacts& facts, int64_t time_ns);
  std::optional<ModeSwitch> begin_change(SessionId session, const ModeChoice& choice, int64_t time_ns);
  ModeSwitch stay(SessionId session, const std::string& reason);
  void count();

  const SceneDesc scene_;
  std::map<SessionId, Viewer> viewers_;
  PictureViews views_;
  std::atomic<uint32_t> strand_viewers_{0};
  std::atomic<uint32_t> frame_viewers_{0};
  std::atomic<uint32_t> viewer_count_{0};
};

}  // namespace strandcast
