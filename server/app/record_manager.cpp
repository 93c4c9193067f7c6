#include "server/app/record_manager.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <utility>

#include "common/base/thread_name.h"
#include "common/log/log.h"
#include "server/app/head_files.h"
#include "server/app/joined_answers.h"
#include "server/net/roles.h"

namespace strandcast {
namespace {

constexpr double kBytesPerMb = 1e6;
constexpr double kBytesPerGb = 1e9;
constexpr const char* kEnding = ".mcap";
/// Recordings without a given name that may begin within one second.
constexpr int kMaxAlike = 10;
constexpr std::chrono::seconds kRoomInterval{1};
constexpr std::chrono::milliseconds kTapPoll{50};

/// Knows ASCII alone, whatever the locale says.
bool is_letter_or_digit(char character) {
  const char lower = static_cast<char>(character | 0x20);
  return (lower >= 'a' && lower <= 'z') || (character >= '0' && character <= '9');
}

bool may_be_in_name(char character) {
  return is_letter_or_digit(character) || std::string_view(" ._-+").find(character) != std::string_view::npos;
}

/// Tells two recordings of every step.
class TapPair : public StepTap {
 public:
  TapPair(StepTap& first, StepTap& second) : taps_{&first, &second} {}

  void on_step(const TakenStep& step) override {
    for (StepTap* tap : taps_) tap->on_step(step);
  }
  void on_change(const PostedChange& change) override {
    for (StepTap* tap : taps_) tap->on_change(change);
  }
  void on_answer(const Notice& answer) override {
    for (StepTap* tap : taps_) tap->on_answer(answer);
  }
  void on_lattice(const LatticeChange& change) override {
    for (StepTap* tap : taps_) tap->on_lattice(change);
  }
  void on_hand_over(const HandOver& hand_over) override {
    for (StepTap* tap : taps_) tap->on_hand_over(hand_over);
  }

 private:
  const std::array<StepTap*, 2> taps_;
};

/// Describes a recording; `end` says why it ended by itself, empty = it goes on.
std::string text_of(const Recorder& recorder, const std::string& end) {
  const RecordCounters counts = recorder.counters();
  const std::string text =
      fmt::format("{}: {:.1f} s, {:.1f} MB", recorder.path().filename().string(), counts.length_s,
                  static_cast<double>(counts.written_bytes) / kBytesPerMb);
  const std::string take = recorder.take();
  const std::string whole = take.empty() ? text : text + ", " + take;
  return end.empty() ? whole : whole + "; it ended by itself: " + end;
}

/// What a tap was told, for a thread that waits for it.
struct Tapped {
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<uint64_t> tick;
};

}  // namespace

std::optional<uint64_t> free_bytes_of(const std::filesystem::path& folder) {
  std::error_code failure;
  const std::filesystem::space_info space = std::filesystem::space(folder, failure);
  if (failure) return std::nullopt;
  return space.available;
}

Result<std::string> recording_file_name(const std::string& name) {
  std::string_view stem = name;
  if (stem.ends_with(kEnding)) stem.remove_suffix(std::string_view(kEnding).size());
  const bool has_good_ends =
      !stem.empty() && is_letter_or_digit(stem.front()) && stem.back() != '.' && stem.back() != ' ';
  if (!has_good_ends || stem.size() > kMaxRecordingNameChars || stem.find("..") != std::string_view::npos ||
      !std::all_of(stem.begin(), stem.end(), may_be_in_name))
    return make_error(
        ErrorCode::BadInput,
        "A recording cannot be called so: its name is at most {} letters, digits, spaces and . _ - +, "
        "without a folder, and begins with a letter or digit.",
        kMaxRecordingNameChars);
  return std::string(stem) + kEnding;
}

std::string recording_name(const RecordCommand& command) {
  if (!command.name.empty() || (command.slate.empty() && command.take == 0)) return command.name;
  const std::string take = command.take == 0 ? "" : fmt::format("T{:02}", command.take);
  std::string name = command.slate + (command.slate.empty() || take.empty() ? "" : "-") + take;
  if (recording_file_name(name)) return name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_letter_or_digit(c) && c != '-'; }, '_');
  return is_letter_or_digit(name.front()) ? name : "slate" + name;
}

std::string recording_file_name(const std::string& scene, int64_t unix_time_s) {
  std::string stem = scene.substr(0, kMaxRecordingNameChars / 2);
  std::replace_if(
      stem.begin(), stem.end(),
      [](char character) { return !may_be_in_name(character) || character == '.' || character == ' '; }, '_');
  if (stem.empty() || !is_letter_or_digit(stem.front())) stem.insert(0, "run");
  const auto seconds = static_cast<std::time_t>(unix_time_s);
  std::tm parts{};
  char time[32] = "";
  if (::gmtime_r(&seconds, &parts) != nullptr) std::strftime(time, sizeof(time), "-%Y%m%dT%H%M%SZ", &parts);
  return stem + time + kEnding;
}

Result<std::unique_ptr<RecordManager>> RecordManager::make(const std::optional<RecordConfig>& first,
                                                           const std::optional<RecordFolder>& folder) {
  std::optional<RecordFolder> whole = folder;
  if (whole) {
    std::error_code failure;
    whole->path = std::filesystem::absolute(whole->path, failure);
    if (!failure) std::filesystem::create_directories(whole->path, failure);
    if (failure || !std::filesystem::is_directory(whole->path, failure))
      return at(folder->path.string(),
                make_error(ErrorCode::NotFound, "no folder for recordings can be made here (--record-dir)"));
  }
  std::unique_ptr<RecordManager> manager(new RecordManager(std::move(whole)));
  if (first) {
    ASSIGN_OR_RETURN(manager->whole_, Recorder::make(*first));
  }
  return manager;
}

RecordManager::~RecordManager() {
  stop();
}

Status RecordManager::attach(Stream stream) {
  stream_.emplace(std::move(stream));
  return whole_ != nullptr ? whole_->attach(stream_->hub) : Status();
}

void RecordManager::begin() {
  if (whole_ != nullptr) {
    whole_->set_shared(stream_->is_shared);
    whole_->begin(stream_->describe(), stream_->asset());
  }
  if (!folder_) return;
  if (folder_->file_ending.empty())
    log_info("record", "who controls may record into {}", folder_->path.string());
  thread_ = std::thread([this] {
    name_thread("record/manager");
    run();
  });
}

void RecordManager::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (const auto& recorder : recorders()) recorder->stop();
}

std::vector<std::shared_ptr<Recorder>> RecordManager::recorders() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Recorder>> all = {whole_, take_};
  std::erase(all, nullptr);
  return all;
}

bool RecordManager::has_take() const {
  const std::lock_guard lock(mutex_);
  return take_ != nullptr;
}

void RecordManager::obey(const RecordCommand& command, Reply reply) {
  if (!folder_) return reply(Notice{true, kNoRecordings});
  {
    const std::lock_guard lock(mutex_);
    if (!order_ && !is_stopping_) {
      order_ = Order{command, std::move(reply)};
      reply = nullptr;
    }
  }
  if (reply) return reply(Notice{true, "A recording is being begun or ended just now: try again."});
  changed_.notify_all();
}

void RecordManager::run() {
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    const auto has_news = [this] { return is_stopping_ || order_.has_value(); };
    if (whole_ != nullptr || take_ != nullptr)
      changed_.wait_for(lock, kRoomInterval, has_news);
    else
      changed_.wait(lock, has_news);
    if (is_stopping_) return;
    const std::optional<Order> order = order_;
    lock.unlock();
    if (order)
      answer(*order);
    else
      watch();
    lock.lock();
  }
}

void RecordManager::answer(const Order& order) {
  const Notice said = carry_out(order.command);
  {
    // Whoever has the answer may ask for more.
    const std::lock_guard lock(mutex_);
    order_.reset();
  }
  order.reply(said);
}

Notice RecordManager::carry_out(const RecordCommand& command) {
  if (command.is_wanted) {
    const Result<std::string> begun = start_recording(command);
    return begun ? Notice{false, *begun} : Notice{true, begun.error().to_string()};
  }
  if (const auto all = recorders(); !all.empty()) return Notice{false, end(all.back())};
  const std::lock_guard lock(mutex_);
  if (!ended_.empty()) return Notice{true, std::exchange(ended_, {})};
  return Notice{true, "Nothing is being recorded: record start begins it."};
}

Status RecordManager::check_room() const {
  const std::string path = folder_->path.string();
  const auto free_bytes = folder_->free_bytes(folder_->path);
  if (free_bytes && *free_bytes < kMinFreeRecordBytes)
    return at(path,
              make_error(ErrorCode::LimitExceeded,
                         "{:.1f} GB are free on its disk, and a recording begins with {:.1f} GB at least",
                         static_cast<double>(*free_bytes) / kBytesPerGb,
                         static_cast<double>(kMinFreeRecordBytes) / kBytesPerGb));
  size_t count = 0;
  std::error_code failure;
  for (std::filesystem::directory_iterator entry(folder_->path, failure), end; !failure && entry != end;
       entry.increment(failure))
    count += entry->path().extension() == kEnding;
  if (failure) return at(path, make_error(ErrorCode::Unavailable, "cannot be read: {}", failure.message()));
  if (count >= kMaxRecordings)
    return at(path, make_error(ErrorCode::LimitExceeded,
                               "{} recordings are there, and no more may be: move some away", count));
  return {};
}

/// Of a file that is not there.
Result<std::filesystem::path> RecordManager::choose_path(const RecordCommand& command) const {
  const auto is_there = [](const std::filesystem::path& path) {
    std::error_code failure;
    return std::filesystem::symlink_status(path, failure).type() != std::filesystem::file_type::not_found;
  };
  std::filesystem::path own = folder_->path / recording_file_name(stream_->scene_name, unix_time_s());
  if (const std::string name = recording_name(command); !name.empty()) {
    ASSIGN_OR_RETURN(const std::string file, recording_file_name(name));
    own = with_file_ending(folder_->path / file, folder_->file_ending);
  }
  if (!command.name.empty() && is_there(own))
    return make_error(ErrorCode::BadInput, "{} is there already: name another one.", own.string());
  // A take is not lost because its name is taken.
  std::filesystem::path path = own;
  for (int number = 2; is_there(path) && number <= kMaxAlike; ++number)
    path.replace_filename(fmt::format("{}-{}{}", own.stem().string(), number, kEnding));
  return path;
}

/// A file that is there by then; all heads together keep the limits of the folder.
Result<std::unique_ptr<Recorder>> RecordManager::make_recorder(const RecordCommand& command) const {
  const std::lock_guard lock(*folder_->beginning);
  ASSIGN_OR_RETURN(const std::filesystem::path path, choose_path(command));
  RETURN_IF_ERROR(check_room());
  return Recorder::make({path, IfPresent::Refuse});
}

/// Gives the step from which on it is so; `at_change` is called there, between two steps. Waits for the
/// source, and only as long as that can answer.
Result<uint64_t> RecordManager::change_tap(StepTap* tap, std::function<void()> at_change) {
  const auto tapped = std::make_shared<Tapped>();
  stream_->source.set_tap(tap, [tapped, at_change = std::move(at_change)](uint64_t tick) {
    if (at_change) at_change();
    const std::lock_guard lock(tapped->mutex);
    tapped->tick = tick;
    tapped->changed.notify_all();
  });
  const auto is_over = [this] {
    if (stream_->source.failure()) return true;
    const std::lock_guard lock(mutex_);
    return is_stopping_;
  };
  std::unique_lock lock(tapped->mutex);
  while (!tapped->tick) {
    if (is_over()) return make_error(ErrorCode::Unavailable, "The server is ending.");
    tapped->changed.wait_for(lock, kTapPoll);
  }
  return *tapped->tick;
}

/// One sentence of where it is.
Result<std::string> RecordManager::start_recording(const RecordCommand& command) {
  for (const auto& present : recorders()) {
    if (present->failure()) {
      end(present);
    } else if (present != whole_) {
      return make_error(ErrorCode::BadInput, "{} is being recorded already: record stop ends it.",
                        present->path().filename().string());
    }
  }
  ASSIGN_OR_RETURN(std::shared_ptr<Recorder> take, make_recorder(command));
  RETURN_IF_ERROR(take->attach(stream_->hub));
  std::unique_ptr<StepTap> both;
  if (whole_ != nullptr) both = std::make_unique<TapPair>(*whole_, *take);
  ASSIGN_OR_RETURN(const uint64_t tick, change_tap(both != nullptr ? both.get() : take.get()));
  RecordingStart start = stream_->describe();
  start.slate = command.slate;
  start.take = command.take;
  take->set_shared(stream_->is_shared);
  take->begin(std::move(start), stream_->asset());
  const std::lock_guard lock(mutex_);
  take_ = std::move(take);
  take_slate_ = recording_name({true, {}, command.slate, command.take});
  both_ = std::move(both);
  ended_.clear();
  return fmt::format("Recording {} from step {} on.", take_->path().string(), tick);
}

/// One sentence of what was recorded.
std::string RecordManager::end(const std::shared_ptr<Recorder>& recorder) {
  Recorder* const other = recorder == whole_ ? take_.get() : whole_.get();
  // Steps and states end together. Without an answer the source has stopped, and tells nobody anything.
  if (change_tap(other, [recorder] { recorder->refuse(); })) recorder->await_last_strands();
  recorder->stop();
  const std::optional<Error> failure = recorder->failure();
  {
    const std::lock_guard lock(mutex_);
    if (failure && recorder == whole_) {
      lost_ = at(recorder->path().string(), *failure);
      lost_counters_ = recorder->counters();
    }
    (recorder == whole_ ? whole_ : take_).reset();
    both_.reset();
  }
  const std::string what = fmt::format("{}: {:.1f} s, {}", recorder->path().string(),
                                       recorder->counters().length_s, recorder->summary());
  return failure ? fmt::format("{}; it ended by itself: {}", what, failure->to_string()) : what + ".";
}

/// A disk that somebody's recording fills up is no use to anybody.
std::string RecordManager::reason_to_end(const Recorder& recorder) const {
  if (const std::optional<Error> failure = recorder.failure()) return failure->to_string();
  // The one of --record is the owner's.
  if (&recorder == whole_.get()) return {};
  const auto free_bytes = folder_->free_bytes(folder_->path);
  if (!free_bytes || *free_bytes >= kMinFreeRecordBytes / 2) return {};
  return fmt::format("{:.1f} GB are free on its disk", static_cast<double>(*free_bytes) / kBytesPerGb);
}

void RecordManager::watch() {
  for (const auto& recorder : recorders()) {
    const std::string reason = reason_to_end(*recorder);
    if (reason.empty()) continue;
    log_warn("record", "{}: the recording ends: {}", recorder->path().string(), reason);
    end(recorder);
    const std::lock_guard lock(mutex_);
    ended_ = text_of(*recorder, reason);
  }
}

std::optional<std::string> RecordManager::slate() const {
  const std::lock_guard lock(mutex_);
  if (take_ != nullptr && !take_->failure()) return take_slate_;
  if (whole_ != nullptr && !whole_->failure()) return std::string();
  return std::nullopt;
}

std::string RecordManager::text() const {
  std::string text;
  for (const auto& recorder : recorders()) {
    const std::optional<Error> failure = recorder->failure();
    text += (text.empty() ? "" : "; ") + text_of(*recorder, failure ? failure->to_string() : std::string());
  }
  if (!text.empty()) return text;
  const std::lock_guard lock(mutex_);
  return ended_;
}

void RecordManager::add(const ServerStatus& status) {
  const auto all = recorders();
  if (all.empty()) return;
  const SimStats simulated = stream_->source.stats();
  for (const auto& recorder : all) {
    recorder->set_step_cost(simulated.step_cost * std::max<uint32_t>(simulated.substeps, 1));
    recorder->add(status);
  }
}

std::optional<Error> RecordManager::failure() const {
  for (const auto& recorder : recorders())
    if (const auto failure = recorder->failure()) return at(recorder->path().string(), *failure);
  const std::lock_guard lock(mutex_);
  return lost_;
}

std::optional<RecordCounters> RecordManager::counters() const {
  std::optional<RecordCounters> sum;
  for (const auto& recorder : recorders()) {
    const RecordCounters one = recorder->counters();
    if (!sum) {
      sum = one;
      continue;
    }
    sum->written_bytes += one.written_bytes;
    sum->waiting_bytes += one.waiting_bytes;
    sum->frame_bytes += one.frame_bytes;
    sum->frames += one.frames;
    sum->states += one.states;
    sum->last_tick = std::max(sum->last_tick, one.last_tick);
    sum->lost_frames += one.lost_frames;
    sum->lost_messages += one.lost_messages;
    sum->length_s = std::max(sum->length_s, one.length_s);
    sum->lag_ms = std::max(sum->lag_ms, one.lag_ms);
    sum->has_failed = sum->has_failed || one.has_failed;
  }
  const std::lock_guard lock(mutex_);
  if (!sum && lost_) return lost_counters_;
  return sum;
}

// ---- all heads ----

void RecordManagers::obey(const RecordCommand& command, const RecordManager::Reply& reply) const {
  std::vector<Of> asked = all_;
  if (!command.is_wanted) std::erase_if(asked, [](const Of& one) { return one.manager->text().empty(); });
  if (asked.empty()) return all_.front().manager->obey(command, reply);
  std::vector<std::string> heads;
  for (const Of& one : asked) heads.push_back(one.head);
  const auto answers = std::make_shared<JoinedAnswers>(std::move(heads), reply);
  for (size_t i = 0; i < asked.size(); ++i)
    asked[i].manager->obey(command, [answers, i](Notice notice) { answers->take(i, std::move(notice)); });
}

std::string RecordManagers::text() const {
  std::string text, others;
  for (const Of& one : all_) {
    const std::string of_head = one.manager->text();
    std::string& where = of_head.empty() ? others : text;
    where += fmt::format("{}{}",
                         where.empty()     ? ""
                         : of_head.empty() ? ", "
                                           : " | ",
                         of_head.empty() ? one.head : of_head);
  }
  return text.empty() || others.empty() ? text : fmt::format("{} | not of {}", text, others);
}

}  // namespace strandcast
