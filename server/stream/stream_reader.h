// StreamReader: whoever takes something out of the stream: the network for its sessions, a recorder, a relay.
// It gets what its demands ask for, on the thread that made it, and must return quickly: it waits for nothing
// and calls the hub only where that is said.
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

  /// A frame of a stream that it wants, in the order of the chain. A chain is entered with a keyframe
  /// (StreamHub::request_keyframe). Once for all demands of this reader that ask for it.
  virtual void on_strands(const EncodedFramePtr& /*frame*/) {}
  virtual void on_picture(PictureClass, const PicturePtr&) {}
  /// This view cannot be drawn.
  virtual void on_picture_refused(PictureClass, const Error&) {}
  /// No pictures can be had any more. Told to all.
  virtual void on_pictures_failed(const Error&) {}
  virtual void on_state(const std::shared_ptr<const Snapshot>&) {}
  virtual void on_motion(uint64_t /*source*/, const MotionSamples&, int64_t /*arrival_ns*/) {}
  virtual void on_wind(uint64_t /*source*/, const WindSamples&, int64_t /*arrival_ns*/) {}
  /// What a viewer of pictures looks through from now on; comes with the inputs.
  virtual void on_camera(uint64_t /*viewer*/, const CameraDesc&) {}
  /// Pictures of this class go on with the look of before: the new one cannot be drawn.
  virtual void on_look_refused(PictureClass, const Error&) {}
  /// The scene looks so from now on. Told to all.
  virtual void on_look_change(const LookChange&) {}
  /// Strands are coded in these classes from now on. Told to all; nothing is encoded so while anybody holds
  /// `until_told`.
  virtual void on_stream_change(const std::vector<StrandClass>& /*classes*/,
                                std::shared_ptr<void> /*until_told*/) {}
  /// Strands have this shape at rest from now on. Told to all; nothing is encoded of it while anybody holds
  /// `until_told`, and nothing that comes later is of the shape before.
  virtual void on_shape_change(const std::shared_ptr<const SceneAsset>& /*asset*/,
                               std::shared_ptr<void> /*until_told*/) {}
};

}  // namespace strandcast
