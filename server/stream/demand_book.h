// DemandBook: the demands of all readers, and their total. Pure bookkeeping, one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "common/render/hair_size.h"
#include "common/scene/features.h"
#include "server/stream/demand.h"

namespace strandcast {

/// Properties of a reader by which shares are counted.
struct ReaderTraits {
  std::string peer;            // address, or what counts as one
  bool is_controller = false;  // or more
};

/// What a source has to provide for all readers together.
struct SourceDemand {
  RuntimeFacts facts;
  bool has_state_readers = false;
  /// Height of the hair on the largest screen in pixels. Infinity: a reader did not say, or records states.
  /// 0: the hair is in no picture, or nobody reads.
  double hair_px = 0.0;

  bool is_watched() const { return has_state_readers || facts.strand_viewers + facts.frame_viewers > 0; }
};

class DemandBook : public DemandSink {
 public:
  /// Makes an empty book. `scene_view` as in PictureViews; `picture_source` is the strand stream from which
  /// pictures are drawn.
  DemandBook(PictureView scene_view, const PictureBudget& budget, uint16_t picture_source = 0)
      : picture_source_(picture_source), views_(std::move(scene_view), budget) {}

  ReaderId add(const ReaderTraits& traits);
  Result<PictureClass> set_demand(ReaderId reader, const Demand& demand) override;
  PictureBudget picture_budget() const override { return views_.budget(); }
  /// Sets the budget; call it before the first demand for pictures.
  void set_picture_budget(const PictureBudget& budget) { views_.set_budget(budget); }
  /// Sets the extent of the hair, from which its height in pictures is computed.
  void set_hair(const HairExtent& extent) { hair_ = extent; }
  void set_scene_camera(const CameraDesc& camera) { views_.set_reserved_camera(camera); }
  /// Removes a reader; ignored if it is unknown.
  void remove(ReaderId reader);

  /// Returns a reader's demand; empty for an unknown one.
  Demand demand_of(ReaderId reader) const;
  PictureClass picture_class_of(ReaderId reader) const { return views_.class_of(reader); }
  std::map<uint32_t, PictureView> picture_views() const { return views_.views(); }
  /// Returns whether a reader's pictures are soon wanted again.
  bool awaits_pictures() const;
  uint32_t strand_readers(uint16_t stream_id) const;
  /// Returns the streams to be encoded: those that readers want, and the one that pictures are drawn from.
  std::set<uint16_t> strand_streams() const;
  /// Returns the total; a reader that wants strands and pictures counts for both.
  SourceDemand total() const;

 private:
  struct Reader {
    ReaderTraits traits;
    Demand demand;
  };
  double hair_px(const Demand& demand) const;

  const uint16_t picture_source_;
  std::map<ReaderId, Reader> readers_;
  PictureViews views_;
  std::optional<HairExtent> hair_;
  ReaderId next_reader_ = 1;
};

}  // namespace strandcast
