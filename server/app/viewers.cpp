#include "server/app/viewers.h"

#include <algorithm>

namespace strandcast {

Result<Viewers::Place> Viewers::add(SessionId session, const Hello& hello) {
  Place place;
  Viewer viewer;
  viewer.role = hello.role;
  place.size = {hello.frame_width > 0 ? hello.frame_width : scene_.stream.frame_width,
                hello.frame_height > 0 ? hello.frame_height : scene_.stream.frame_height};
  if (hello.role == Role::Source) {
    place.reason = "a source gets no stream";
  } else if (hello.mode == StreamMode::Frames) {
    place.mode = StreamMode::Frames;
    place.reason = "frames were asked for";
    viewer.view = {scene_.camera, place.size, static_cast<int>(scene_.stream.jpeg_quality)};
    RETURN_IF_ERROR(validate(viewer.view));
    ASSIGN_OR_RETURN(place.picture_class, views_.assign(session, viewer.view));
  } else {
    place.reason = hello.mode == StreamMode::Strands
                       ? "strands were asked for"
                       : "strands: one stream serves every camera, and the viewer draws at its own rate";
  }
  viewer.mode = place.mode;
  viewers_[session] = viewer;
  count();
  return place;
}

void Viewers::remove(SessionId session) {
  views_.remove(session);
  viewers_.erase(session);
  count();
}

Result<PictureClass> Viewers::set_camera(SessionId session, const CameraDesc& camera) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.mode != StreamMode::Frames)
    return make_error(ErrorCode::NotFound, "only viewers of frames have a camera on the server");
  PictureView view = found->second.view;
  view.camera = camera;
  RETURN_IF_ERROR(validate(view));
  ASSIGN_OR_RETURN(const uint32_t picture_class, views_.assign(session, view));
  found->second.view = view;
  return picture_class;
}

void Viewers::set_strand_class(SessionId session, uint16_t stream_id) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end()) found->second.strand_class = stream_id;
}

uint32_t Viewers::strand_viewers(uint16_t stream_id) const {
  return static_cast<uint32_t>(std::count_if(viewers_.begin(), viewers_.end(), [&](const auto& item) {
    const Viewer& viewer = item.second;
    return viewer.role != Role::Source && viewer.mode == StreamMode::Strands &&
           viewer.strand_class == stream_id;
  }));
}

RuntimeFacts Viewers::facts() const {
  RuntimeFacts facts;
  facts.strand_viewers = strand_viewers_;
  facts.frame_viewers = frame_viewers_;
  return facts;
}

void Viewers::count() {
  uint32_t strands = 0;
  uint32_t frames = 0;
  for (const auto& [session, viewer] : viewers_)
    if (viewer.role != Role::Source) ++(viewer.mode == StreamMode::Frames ? frames : strands);
  strand_viewers_ = strands;
  frame_viewers_ = frames;
}

}  // namespace strandcast
