// StreamReader: interface of anything that receives the stream: the network for its sessions, a recorder, a
// relay. Its functions deliver what its demands ask for, on the thread that produced it. They must return
// quickly without waiting, and may call the hub only where that is stated.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/picture.h"
#include "common/strands/frame_header.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"
#include "common/wire/messages.h"
#include "server/net/strand_class.h"
#include "server/stream/demand.h"

namespace strandcast {

class StreamReader {
 public:
  virtual ~StreamReader() = default;

  /// Delivers a strand frame in the order of its chain, once for all demands of this reader. A chain must be
  /// entered with a keyframe (StreamHub::request_keyframe()).
  virtual void on_strands(const EncodedFramePtr& /*frame*/) {}
  virtual void on_picture(PictureClass, const PicturePtr&) {}
  /// Reports that the view of this class cannot be drawn.
  virtual void on_picture_refused(PictureClass, const Error&) {}
  /// Reports to all readers that pictures can no longer be drawn.
  virtual void on_pictures_failed(const Error&) {}
  virtual void on_state(const std::shared_ptr<const Snapshot>&) {}
  virtual void on_motion(uint64_t /*source*/, const MotionSamples&, int64_t /*arrival_ns*/) {}
  virtual void on_wind(uint64_t /*source*/, const WindSamples&, int64_t /*arrival_ns*/) {}
  /// Delivers the new camera of a viewer of pictures, for readers of inputs.
  virtual void on_camera(uint64_t /*viewer*/, const CameraDesc&) {}
  /// Reports that pictures of this class keep the previous look, because the new one cannot be drawn.
  virtual void on_look_refused(PictureClass, const Error&) {}
  /// Reports a new look to all readers.
  virtual void on_look_change(const LookChange&) {}
  /// Reports new strand classes to all readers. They are not used while any reader holds `until_told`.
  virtual void on_stream_change(const std::vector<StrandClass>& /*classes*/,
                                std::shared_ptr<void> /*until_told*/) {}
  /// Reports a new rest shape to all readers. No frame of it is encoded while any reader holds `until_told`;
  /// all later frames are of this shape.
  virtual void on_shape_change(const std::shared_ptr<const SceneAsset>& /*asset*/,
                               std::shared_ptr<void> /*until_told*/) {}
};

}  // namespace strandcast
