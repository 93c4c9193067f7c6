// The page's files on a connection that is kept for the next request.
#include <utility>

#include "common/base/profile.h"
#include "common/wire/session_path.h"
#include "server/net/connection_private.h"

namespace strandcast::net {
namespace {

/// For good where the name changes with the content; else it is asked each time whether it is still that.
constexpr const char* kKeepForGood = "public, max-age=31536000, immutable";
constexpr const char* kAskEachTime = "no-cache";

}  // namespace

bool Connection::answer_page(const Request& request) {
  const std::string_view path = path_of_target(without_session(view(request.target())));
  const PageFile* file = find_page_file(context_.config.page, path);
  if (file == nullptr) {
    if (path != "/" || !context_.config.page.empty()) return false;
    respond(
        http::status::not_found,
        "This server was built without its page for browsers (cmake -DSTRANDCAST_WEB=ON); strandcast-view "
        "shows the hair.\n");
    return true;
  }
  if (request.method() == http::verb::get || request.method() == http::verb::head) {
    send_page_file(request, *file);
    return true;
  }
  response_.set(http::field::allow, "GET, HEAD");
  refuse(Refusal::Request, http::status::method_not_allowed, "The page is served by GET and HEAD only.");
  return true;
}

void Connection::send_page_file(const Request& request, const PageFile& file) {
  const PageCoding coding = best_coding(view(request[http::field::accept_encoding]));
  const std::string_view content = content_of(file, coding);
  const std::string tag = fmt::format("\"{}-{}\"", file.version, name_of(coding));
  const bool is_known = names_tag(view(request[http::field::if_none_match]), tag);
  const bool has_content = !is_known && request.method() == http::verb::get;

  page_response_ = {};
  page_response_.version(11);
  page_response_.result(is_known ? http::status::not_modified : http::status::ok);
  page_response_.set(http::field::server, "strandcast");
  page_response_.set(http::field::etag, tag);
  page_response_.set(http::field::vary, "Accept-Encoding");
  page_response_.set(http::field::cache_control,
                     file.name == PageFileName::Hashed ? kKeepForGood : kAskEachTime);
  page_response_.set("Content-Security-Policy", page_policy(view(request[http::field::host])));
  page_response_.set("X-Content-Type-Options", "nosniff");
  page_response_.set("Referrer-Policy", "no-referrer");
  page_response_.set("Cross-Origin-Opener-Policy", "same-origin");
  page_response_.set("Cross-Origin-Embedder-Policy", "require-corp");
  page_response_.set("Cross-Origin-Resource-Policy", "same-origin");
  if (!is_known) {
    page_response_.set(http::field::content_type, file.media_type);
    if (coding != PageCoding::Plain) page_response_.set(http::field::content_encoding, name_of(coding));
    page_response_.content_length(content.size());
  }
  const bool is_last = ++answered_ >= kMaxRequestsOfConnection;
  page_response_.keep_alive(request.keep_alive() && !is_last);
  page_response_.body() = has_content
                              ? http::span_body<const char>::value_type(content.data(), content.size())
                              : http::span_body<const char>::value_type();
  since_ns_ = now_ns();
  page_serializer_.emplace(page_response_);
  page_serializer_->limit(kWriteChunkBytes);
  write_page();
}

void Connection::write_page() {
  http::async_write_some(stream_, *page_serializer_,
                         [self = shared_from_this()](const beast::error_code& error, size_t size) {
                           self->guarded([&] { self->on_page_written(error, size); });
                         });
}

void Connection::on_page_written(const beast::error_code& error, size_t size) {
  if (is_finished_) return;
  if (error) return finish();
  handed_bytes_ += size;
  if (!page_serializer_->is_done()) return write_page();
  if (page_response_.keep_alive()) return read_next_request();
  stream_.async_shut_down([self = shared_from_this()](const beast::error_code&) { self->finish(); });
}

/// A proxy may ask for somebody else next.
void Connection::read_next_request() {
  peer_ = from_;
  since_ns_ = now_ns();
  read_request();
}

/// What the other side's kernel took is progress; so little of it in so long a time is none.
void Connection::note_progress(int64_t time_ns) {
  const size_t untaken_bytes = stream_.untaken_bytes();
  const size_t taken_bytes = handed_bytes_ - std::min(handed_bytes_, untaken_bytes);
  if (taken_bytes < noted_bytes_ + kLeastProgressBytes) return;
  noted_bytes_ = taken_bytes;
  since_ns_ = time_ns;
}

bool Connection::is_idle() const {
  return answered_ > 0 && is_reading_ && buffer_.size() == 0 && !parser_->got_some();
}

}  // namespace strandcast::net
