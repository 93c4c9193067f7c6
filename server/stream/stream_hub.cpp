#include "server/stream/stream_hub.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "common/base/check.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

/// Sizes that differ by less than this share are one.
constexpr double kSameSize = 0.02;

bool is_same_size(double a, double b) {
  return a == b || std::abs(a - b) < kSameSize * std::min(a, b);
}

bool is_alike(const SourceDemand& a, const SourceDemand& b) {
  return is_same_size(a.hair_px, b.hair_px) && a.facts.strand_viewers == b.facts.strand_viewers &&
         a.facts.frame_viewers == b.facts.frame_viewers && a.has_state_readers == b.has_state_readers;
}

std::vector<std::string> codecs_of(const StreamHubConfig& config) {
  std::vector<std::string> codecs{config.stream.codec};
  for (const std::string& other : {config.fallback_codec, config.picture_codec})
    if (!other.empty()) codecs.push_back(other);
  return codecs;
}

}  // namespace

/// Pictures are drawn from all strands of the last codec.
StreamHub::StreamHub(StreamHubConfig config)
    : config_(std::move(config)),
      codecs_(codecs_of(config_)),
      picture_source_(stream_id_of({codecs_.size() - 1, 0})),
      asset_(config_.asset),
      make_painter_(config_.make_painter),
      stream_(config_.stream),
      look_(config_.look),
      book_(config_.scene_view, kSoftwareBudget, picture_source_) {
  if (asset_ != nullptr) book_.set_hair(hair_extent(*asset_));
}

Result<std::unique_ptr<StreamHub>> StreamHub::make(StreamHubConfig config) {
  std::unique_ptr<StreamHub> hub(new StreamHub(std::move(config)));
  RETURN_IF_ERROR(hub->begin());
  return hub;
}

StreamHub::~StreamHub() {
  stop();
}

Status StreamHub::begin() {
  // A wrong codec is told here, and encoders can be made later without a way to fail.
  for (const std::string& codec : codecs_) RETURN_IF_ERROR(make_strand_encoder(codec));
  classes_ = classes_of(stream_);
  ASSIGN_OR_RETURN(frames_, make_frames());
  return {};
}

/// What draws strands of the present shape.
Result<std::unique_ptr<FrameWorker>> StreamHub::make_frames() {
  const SceneAsset& asset = *asset_;
  ASSIGN_OR_RETURN(auto decoder,
                   make_strand_decoder(codecs_.back(), {asset.strand_count, asset.vertex_count}));
  decoder->set_rest_shape(asset.rest_position_m);
  FrameWorker::Hooks hooks;
  hooks.sink = [this](PictureClass picture_class, PicturePtr picture) {
    give([&](const Entry& entry) { return entry.picture_class == picture_class; },
         [&](StreamReader& reader) { reader.on_picture(picture_class, picture); });
  };
  hooks.request_keyframe = [this] { request_keyframe(picture_source_); };
  hooks.request_state = [this](int64_t not_before_ns) {
    const std::lock_guard lock(mutex_);
    if (StrandEncodeWorker* worker = find_encoder(picture_source_)) worker->request_state(not_before_ns);
  };
  hooks.on_refused = [this](PictureClass picture_class, const Error& error) {
    give([&](const Entry& entry) { return entry.picture_class == picture_class; },
         [&](StreamReader& reader) { reader.on_picture_refused(picture_class, error); });
  };
  hooks.on_look_refused = [this](PictureClass picture_class, const Error& error) {
    give([&](const Entry& entry) { return entry.picture_class == picture_class; },
         [&](StreamReader& reader) { reader.on_look_refused(picture_class, error); });
  };
  hooks.on_failure = [this](const Error& error) {
    give([](const Entry&) { return true; }, [&](StreamReader& reader) { reader.on_pictures_failed(error); });
  };
  return std::make_unique<FrameWorker>(std::move(decoder), make_painter_,
                                       FrameWorkerConfig{stream_.frame_rate_hz}, std::move(hooks));
}

/// Gives something to every reader with a demand for it, once.
template <class IsWanted, class Give>
void StreamHub::give(IsWanted is_wanted, Give give_one) {
  const std::lock_guard giving(giving_mutex_);
  std::set<StreamReader*> readers;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, entry] : entries_)
      if (is_wanted(entry)) readers.insert(entry.reader);
  }
  for (StreamReader* reader : readers) give_one(*reader);
}

ReaderId StreamHub::add(StreamReader& reader, const ReaderTraits& traits) {
  const std::lock_guard lock(mutex_);
  const ReaderId id = book_.add(traits);
  entries_[id].reader = &reader;
  return id;
}

Result<PictureClass> StreamHub::set_demand(ReaderId reader, const Demand& demand) {
  const std::lock_guard order(demand_mutex_);
  PictureClass picture_class = 0;
  {
    const std::lock_guard lock(mutex_);
    if (demand.strand_stream && !is_stream(*demand.strand_stream))
      return make_error(ErrorCode::BadInput, "there is no stream {} of strands", *demand.strand_stream);
    ASSIGN_OR_RETURN(picture_class, book_.set_demand(reader, demand));
    entries_[reader].demand = demand;
    entries_[reader].picture_class = picture_class;
  }
  follow_demand();
  return picture_class;
}

PictureBudget StreamHub::picture_budget() const {
  const std::lock_guard lock(mutex_);
  return book_.picture_budget();
}

void StreamHub::set_picture_budget(const PictureBudget& budget) {
  const std::lock_guard lock(mutex_);
  book_.set_picture_budget(budget);
}

void StreamHub::remove(ReaderId reader) {
  const std::lock_guard order(demand_mutex_);
  {
    const std::lock_guard giving(giving_mutex_);
    const std::lock_guard lock(mutex_);
    book_.remove(reader);
    entries_.erase(reader);
  }
  follow_demand();
}

void StreamHub::set_source(std::function<void(const SourceDemand&)> on_demand) {
  const std::lock_guard order(demand_mutex_);
  on_demand_ = std::move(on_demand);
  told_ = total();
  if (on_demand_) on_demand_(told_);
}

/// What runs follows what is wanted. demand_mutex_ is held.
void StreamHub::follow_demand() {
  {
    const std::lock_guard lock(mutex_);
    if (has_stopped_ || is_reshaping_) return;
    frames_->set_views(book_.picture_views(), book_.awaits_pictures() ? kPainterRestNs : 0);
    const std::set<uint16_t> wanted = book_.strand_streams();
    for (const uint16_t stream_id : wanted)
      encoder(stream_id).set_listeners(book_.strand_readers(stream_id) > 0 ? StrandListeners::All
                                                                           : StrandListeners::OnRequest);
    for (const auto& [stream_id, worker] : encoders_)
      if (!wanted.contains(stream_id)) worker->set_listeners(StrandListeners::None);
  }
  // A camera that turns is no news for the source, unless hair gets larger or smaller by it.
  if (const SourceDemand now = total(); !is_alike(now, told_)) {
    told_ = now;
    if (on_demand_) on_demand_(now);
  }
}

bool StreamHub::is_stream(uint16_t stream_id) const {
  const StrandStream stream = strand_stream_of(stream_id);
  return stream.codec < codecs_.size() && stream.strand_class < classes_.size();
}

/// Null while nobody has needed it. mutex_ is held.
StrandEncodeWorker* StreamHub::find_encoder(uint16_t stream_id) const {
  const auto found = encoders_.find(stream_id);
  return found != encoders_.end() ? found->second.get() : nullptr;
}

/// The encoder of a stream, made when it is needed first. mutex_ is held.
StrandEncodeWorker& StreamHub::encoder(uint16_t stream_id) {
  if (StrandEncodeWorker* present = find_encoder(stream_id)) return *present;
  auto made = make_strand_encoder(codecs_[strand_stream_of(stream_id).codec]);
  CHECK(made.ok());  // begin() has made one
  (*made)->set_rest_shape(asset_->rest_position_m);
  auto worker = std::make_unique<StrandEncodeWorker>(
      slot_, std::move(*made), [this](const EncodedFramePtr& frame) { give_strands(frame); },
      encode_config(stream_id), stream_id == 0 ? config_.shared : nullptr);
  return *(encoders_[stream_id] = std::move(worker));
}

void StreamHub::give_strands(const EncodedFramePtr& frame) {
  const uint16_t stream_id = frame->header.stream_id;
  if (stream_id == picture_source_) {
    const std::lock_guard lock(mutex_);
    if (frames_ != nullptr && frames_->has_views()) frames_->offer(frame);
  }
  give([&](const Entry& entry) { return entry.demand.strand_stream == stream_id; },
       [&](StreamReader& reader) { reader.on_strands(frame); });
}

std::vector<StrandClass> StreamHub::classes_of(const StreamDesc& stream) const {
  return make_strand_classes(
      {config_.step_rate_hz, stream.strand_rate_hz, stream.bound_m, asset_->strand_count});
}

StrandEncodeConfig StreamHub::encode_config(uint16_t stream_id) const {
  const StrandClass& row = classes_[strand_stream_of(stream_id).strand_class];
  const Result<float> quantum_m = lattice_step_m(stream_.codec, stream_.bound_m);
  CHECK(quantum_m.ok());  // as above
  return {stream_id, row.rate_divisor, row.coarsening, row.strand_share, *quantum_m};
}

void StreamHub::put(std::shared_ptr<const Snapshot> state) {
  if (config_.on_state) config_.on_state(*state);
  give([](const Entry& entry) { return entry.demand.has_states; },
       [&](StreamReader& reader) { reader.on_state(state); });
  slot_.put(std::move(state));
}

/// States on the new lattice wait in the slot until every reader has told whoever must know.
void StreamHub::change_stream(const StreamDesc& stream) {
  const std::vector<StrandClass> classes = classes_of(stream);
  const std::shared_ptr<void> until_told(nullptr,
                                         [this, stream, classes](void*) { begin_stream(stream, classes); });
  give([](const Entry&) { return true; },
       [&](StreamReader& reader) { reader.on_stream_change(classes, until_told); });
}

/// Whoever joins from now on is told this look, and those who are there after it.
void StreamHub::change_look(const LookChange& look) {
  {
    const std::lock_guard lock(mutex_);
    look_ = look;
    book_.set_scene_camera(look.camera);
    if (frames_ != nullptr) frames_->set_look(look.look);
  }
  give([](const Entry&) { return true; }, [&](StreamReader& reader) { reader.on_look_change(look); });
}

/// Encoders and painters of the old shape end first, so that nothing of theirs comes behind the news; those
/// of the new one begin when every reader has told whoever must know.
void StreamHub::change_shape(std::shared_ptr<const SceneAsset> asset) {
  std::map<uint16_t, std::unique_ptr<StrandEncodeWorker>> encoders;
  std::unique_ptr<FrameWorker> frames;
  uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (has_stopped_) return;
    is_reshaping_ = true;
    number = ++shapes_;
    encoders.swap(encoders_);
    frames.swap(frames_);
  }
  encoders.clear();
  frames.reset();
  const std::shared_ptr<void> until_told(nullptr,
                                         [this, asset, number](void*) { begin_shape(asset, number); });
  give([](const Entry&) { return true; },
       [&](StreamReader& reader) { reader.on_shape_change(asset, until_told); });
}

void StreamHub::begin_shape(std::shared_ptr<const SceneAsset> asset, uint64_t number) {
  const std::lock_guard order(demand_mutex_);
  {
    const std::lock_guard lock(mutex_);
    if (has_stopped_ || number != shapes_) return;  // the newest alone
    asset_ = std::move(asset);
    if (config_.painter_of) make_painter_ = config_.painter_of(asset_, look_.look);
    book_.set_hair(hair_extent(*asset_));
    auto frames = make_frames();
    CHECK(frames.ok());  // begin() has made some, for as many strands
    frames_ = std::move(frames).value();
    is_reshaping_ = false;
  }
  follow_demand();
}

void StreamHub::begin_stream(const StreamDesc& stream, const std::vector<StrandClass>& classes) {
  const std::lock_guard lock(mutex_);
  stream_ = stream;
  classes_ = classes;
  for (const auto& [stream_id, worker] : encoders_)
    if (is_stream(stream_id)) worker->change(encode_config(stream_id));
}

void StreamHub::request_keyframe(uint16_t stream_id) {
  const std::lock_guard lock(mutex_);
  if (StrandEncodeWorker* worker = find_encoder(stream_id)) worker->request_keyframe();
}

void StreamHub::request_whole(PictureClass picture_class) {
  const std::lock_guard lock(mutex_);
  if (frames_ != nullptr) frames_->request_whole(picture_class);
}

void StreamHub::redraw() {
  const std::lock_guard lock(mutex_);
  if (frames_ != nullptr) frames_->redraw();
}

void StreamHub::tell_motion(uint64_t source, const MotionSamples& samples, int64_t arrival_ns) {
  give([](const Entry& entry) { return entry.demand.has_inputs; },
       [&](StreamReader& reader) { reader.on_motion(source, samples, arrival_ns); });
}

void StreamHub::tell_wind(uint64_t source, const WindSamples& samples, int64_t arrival_ns) {
  give([](const Entry& entry) { return entry.demand.has_inputs; },
       [&](StreamReader& reader) { reader.on_wind(source, samples, arrival_ns); });
}

void StreamHub::tell_camera(uint64_t viewer, const CameraDesc& camera) {
  give([](const Entry& entry) { return entry.demand.has_inputs; },
       [&](StreamReader& reader) { reader.on_camera(viewer, camera); });
}

StreamDesc StreamHub::stream() const {
  const std::lock_guard lock(mutex_);
  return stream_;
}

LookChange StreamHub::look() const {
  const std::lock_guard lock(mutex_);
  return look_;
}

std::vector<StrandClass> StreamHub::strand_classes() const {
  const std::lock_guard lock(mutex_);
  return classes_;
}

std::map<uint32_t, PictureView> StreamHub::picture_views() const {
  const std::lock_guard lock(mutex_);
  return book_.picture_views();
}

uint32_t StreamHub::strand_readers(uint16_t stream_id) const {
  const std::lock_guard lock(mutex_);
  return book_.strand_readers(stream_id);
}

SourceDemand StreamHub::total() const {
  const std::lock_guard lock(mutex_);
  return book_.total();
}

FrameCounters StreamHub::frame_counters() const {
  const std::lock_guard lock(mutex_);
  return frames_ != nullptr ? frames_->counters() : FrameCounters{};
}

std::vector<PictureMotion> StreamHub::take_picture_motions() {
  const std::lock_guard lock(mutex_);
  return frames_ != nullptr ? frames_->take_motions() : std::vector<PictureMotion>();
}

std::map<uint16_t, StrandEncodeCounters> StreamHub::encode_counters() const {
  const std::lock_guard lock(mutex_);
  std::map<uint16_t, StrandEncodeCounters> counters;
  for (const auto& [stream_id, worker] : encoders_) counters[stream_id] = worker->counters();
  return counters;
}

gl::PassReports StreamHub::strand_passes() const {
  const std::lock_guard lock(mutex_);
  gl::PassReports passes;
  for (const auto& [stream_id, worker] : encoders_) passes.push_back(worker->pass());
  if (find_encoder(0) == nullptr) passes.insert(passes.begin(), strand_encode_report(0, false, StageTimer()));
  return passes;
}

gl::PassReports StreamHub::picture_passes() const {
  const std::lock_guard lock(mutex_);
  return frames_ != nullptr ? frames_->passes() : gl::PassReports{};
}

std::optional<Error> StreamHub::picture_failure() const {
  const std::lock_guard lock(mutex_);
  return frames_ != nullptr ? frames_->failure() : std::nullopt;
}

void StreamHub::stop() {
  slot_.stop();
  // Each worker calls the hub: all are taken out of reach before their threads are joined.
  std::map<uint16_t, std::unique_ptr<StrandEncodeWorker>> encoders;
  std::unique_ptr<FrameWorker> frames;
  const std::lock_guard giving(giving_mutex_);
  const std::lock_guard lock(mutex_);
  has_stopped_ = true;
  entries_.clear();
  encoders.swap(encoders_);
  frames.swap(frames_);
}

}  // namespace strandcast
