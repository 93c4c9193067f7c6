#include "server/stream/demand_book.h"

#include <algorithm>
#include <limits>

namespace strandcast {

ReaderId DemandBook::add(const ReaderTraits& traits) {
  readers_[next_reader_].traits = traits;
  return next_reader_++;
}

Result<PictureClass> DemandBook::set_demand(ReaderId reader, const Demand& demand) {
  const auto found = readers_.find(reader);
  if (found == readers_.end()) return make_error(ErrorCode::NotFound, "there is no reader {}", reader);
  PictureClass picture_class = 0;
  if (demand.picture) {
    const ReaderTraits& traits = found->second.traits;
    ASSIGN_OR_RETURN(picture_class,
                     views_.assign({reader, traits.peer, traits.is_controller}, *demand.picture));
  } else {
    views_.remove(reader);
  }
  found->second.demand = demand;
  return picture_class;
}

void DemandBook::remove(ReaderId reader) {
  views_.remove(reader);
  readers_.erase(reader);
}

Demand DemandBook::demand_of(ReaderId reader) const {
  const auto found = readers_.find(reader);
  return found != readers_.end() ? found->second.demand : Demand{};
}

bool DemandBook::awaits_pictures() const {
  return std::any_of(readers_.begin(), readers_.end(),
                     [](const auto& entry) { return entry.second.demand.awaits_picture; });
}

uint32_t DemandBook::strand_readers(uint16_t stream_id) const {
  return static_cast<uint32_t>(std::count_if(readers_.begin(), readers_.end(), [&](const auto& entry) {
    return entry.second.demand.strand_stream == stream_id;
  }));
}

std::set<uint16_t> DemandBook::strand_streams() const {
  std::set<uint16_t> streams;
  for (const auto& [id, reader] : readers_) {
    if (reader.demand.strand_stream) streams.insert(*reader.demand.strand_stream);
    if (reader.demand.picture) streams.insert(picture_source_);
  }
  return streams;
}

/// On the largest of a reader's screens.
double DemandBook::hair_px(const Demand& demand) const {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (demand.has_states) return kUnknown;
  double px = 0.0;
  if (demand.strand_stream) px = demand.hair_px > 0.0 ? demand.hair_px : kUnknown;
  if (!demand.picture) return px;
  const RenderSize& size = demand.picture->size;
  return std::max(
      px, hair_ ? hair_height_px(*hair_, demand.picture->camera, {size.width, size.height}) : kUnknown);
}

SourceDemand DemandBook::total() const {
  SourceDemand total;
  for (const auto& [id, reader] : readers_) {
    total.facts.strand_viewers += reader.demand.strand_stream ? 1 : 0;
    total.facts.frame_viewers += reader.demand.picture ? 1 : 0;
    total.has_state_readers |= reader.demand.has_states;
    total.hair_px = std::max(total.hair_px, hair_px(reader.demand));
  }
  return total;
}

}  // namespace strandcast
