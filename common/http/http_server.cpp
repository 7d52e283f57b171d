// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_server.h"

#include "common/http/own_address.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

namespace gyre {

namespace {

// A connection that is kept open holds a thread, and so does every stream.
constexpr std::size_t server_threads = 32;
constexpr int most_streams = 16;
constexpr std::time_t keep_alive_s = 1;                   // stop() waits for idle connections that long
constexpr std::chrono::milliseconds stop_patience{1500};  // and for the others that long
constexpr std::size_t block_bytes = 1 << 16;
// Of a body nobody takes: more than that, and the connection ends.
constexpr std::uint64_t most_dropped_bytes = 64 << 20;

const std::map<std::string, std::string>& headers_of_every_answer() {
  static const std::map<std::string, std::string> headers = {
      {"Content-Security-Policy",
       "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob:; object-src 'none'; base-uri 'none'; "
       "form-action 'self'; frame-ancestors 'self'"},
      {"X-Content-Type-Options", "nosniff"},
      {"X-Frame-Options", "SAMEORIGIN"},
      {"Referrer-Policy", "no-referrer"},
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Permissions-Policy", "camera=(), microphone=(), geolocation=()"},
      {"Cache-Control", "no-store"},
  };
  return headers;
}

std::string cookie_name(int port) {
  return "gyre-" + std::to_string(port);  // cookies do not tell ports apart
}

std::string cookie_of(const httplib::Request& request, const std::string& name) {
  const std::string all = request.get_header_value("Cookie");
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find(';', at), all.size());
    std::string_view one(all.data() + at, end - at);
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(name + "=")) return std::string(one.substr(name.size() + 1));
    at = end + 1;
  }
  return {};
}

std::string token_of(const httplib::Request& request, int port) {
  constexpr std::string_view scheme = "Bearer ";
  const std::string authorization = request.get_header_value("Authorization");
  if (authorization.starts_with(scheme)) return authorization.substr(scheme.size());
  return cookie_of(request, cookie_name(port));
}

HttpRequest request_of(const httplib::Request& from) {
  HttpRequest request;
  request.method = from.method;
  request.path = from.path;
  for (std::size_t i = 1; i < from.matches.size(); ++i) request.parts.push_back(from.matches[i].str());
  for (const auto& [name, value] : from.params) request.query.emplace(name, value);
  return request;
}

// Hands out a file as its reader asks for it, so that an avatar is never in memory whole.
class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& path) : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)) {
    if (fd_ < 0) return;
    const off_t end = ::lseek(fd_, 0, SEEK_END);
    size_ = end > 0 ? static_cast<std::size_t>(end) : 0;
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  bool is_open() const { return fd_ >= 0; }
  std::size_t size() const { return size_; }
  bool send(std::size_t offset, std::size_t length, httplib::DataSink& sink) const {
    std::array<char, block_bytes> block{};
    const ssize_t got = ::pread(fd_, block.data(), std::min(length, block.size()), static_cast<off_t>(offset));
    return got > 0 && sink.write(block.data(), static_cast<std::size_t>(got));
  }

 private:
  int fd_;
  std::size_t size_ = 0;
};

void send_file(const HttpResponse& from, httplib::Response& to) {
  const auto file = std::make_shared<OpenFile>(from.file);
  if (!file->is_open()) {
    to.status = 404;
    to.set_content("there is no such file", "text/plain");
    return;
  }
  if (file->size() == 0) {
    to.set_content("", from.type);
    return;
  }
  to.set_content_provider(file->size(), from.type,
                          [file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                            return file->send(offset, length, sink);
                          });
}

void send(const HttpResponse& from, httplib::Response& to) {
  // The library sets 200 or, for a part of a file, 206.
  if (from.status != 200) to.status = from.status;
  for (const auto& [name, value] : from.headers) to.set_header(name, value);
  if (from.file.empty()) {
    to.set_content(from.body, from.type);
  } else {
    send_file(from, to);
  }
}

void set_socket_options(socket_t socket) {
  // Not the library's SO_REUSEPORT, by which two programs would share a port without a word.
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

// Ends the connections to that port of this process, or the one of them from that port of a peer. The library does not
// tell which they are.
void hang_up(int port, int peer_port = 0) {
  std::error_code error;
  for (auto it = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error)) {
    const int fd = std::atoi(it->path().filename().c_str());
    sockaddr_storage own{};
    sockaddr_storage peer{};
    socklen_t own_length = sizeof own;
    socklen_t peer_length = sizeof peer;
    if (::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &own_length) != 0 ||
        ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &peer_length) != 0) {
      continue;
    }
    // The port lies at the same place in both kinds of address.
    const bool internet = own.ss_family == AF_INET || own.ss_family == AF_INET6;
    const auto port_of = [](const sockaddr_storage& of) {
      return static_cast<int>(ntohs(reinterpret_cast<const sockaddr_in&>(of).sin_port));
    };
    if (!internet || port_of(own) != port || (peer_port != 0 && port_of(peer) != peer_port)) continue;
    ::shutdown(fd, SHUT_RDWR);
  }
}

}  // namespace

Result<void> HttpOptions::check() const {
  if (port < 0 || port > 65535) return wrong_use("no such port", std::to_string(port), "give 0 to 65535");
  if (!token.empty() && token.size() < 16)
    return wrong_use("the token is too short", "", "give at least 16 characters");
  return {};
}

HttpResponse json_response(const nlohmann::json& json, int status) {
  HttpResponse response;
  response.status = status;
  response.type = "application/json";
  response.body = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return response;
}

HttpResponse error_response(int status, std::string_view message) {
  return json_response({{"error", message}}, status);
}

HttpResponse error_response(const Error& error) {
  return error_response(error.kind == Error::Kind::usage ? 400 : 500, error.message());
}

class HttpServer::Impl {
 public:
  explicit Impl(HttpOptions options) : options_(std::move(options)) {
    server_.new_task_queue = [] { return new httplib::ThreadPool(server_threads); };
    server_.set_socket_options(set_socket_options);
    server_.set_keep_alive_timeout(keep_alive_s);
    server_.set_keep_alive_max_count(1000);
    server_.set_tcp_nodelay(true);
    // Its own limit is not for bodies in chunks, and it keeps what it reads.
    server_.set_payload_max_length(std::numeric_limits<std::size_t>::max());
    server_.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
      // The one method with a body that there can be no handler for.
      if (request.method != "PRI") return httplib::Server::HandlerResponse::Unhandled;
      send(error_response(405, "no such method"), response);
      return httplib::Server::HandlerResponse::Handled;
    });
    server_.set_post_routing_handler([](const httplib::Request&, httplib::Response& response) {
      for (const auto& [name, value] : headers_of_every_answer()) {
        if (!response.has_header(name)) response.set_header(name, value);
      }
    });
    server_.set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
      send(error_response(500, "the request could not be answered"), response);
    });
  }

  httplib::Server::Handler guarded(Handler handler) {
    return [this, handler = std::move(handler)](const httplib::Request& request, httplib::Response& response) {
      if (let_in(request, response)) send(handler(request_of(request)), response);
    };
  }

  using Take = std::function<bool(std::string_view)>;

  // Reads a body to its end, whoever sent it: left in the connection it would be taken for the next request, and its
  // headers for the sender's. `take` gets it until it returns false, the rest is dropped; one that does not end even so
  // ends the connection. False when it was not taken whole.
  bool read_body(const httplib::Request& request, const httplib::ContentReader& content, const Take& take) const {
    bool taking = !request.is_multipart_form_data();
    std::uint64_t dropped = 0;
    const auto receive = [&](const char* data, std::size_t length) {
      taking = taking && take(std::string_view(data, length));
      if (!taking) dropped += length;
      return dropped <= most_dropped_bytes;
    };
    const bool ended = request.is_multipart_form_data()
                           ? content([](const httplib::MultipartFormData&) { return true; }, receive)
                           : content(receive);
    if (!ended) hang_up(port_, request.remote_port);
    return ended && taking;
  }

  static bool take_nothing(std::string_view) { return false; }

  // Of methods that bring a body.
  httplib::Server::HandlerWithContentReader guarded_body(Handler handler) {
    return [this, handler = std::move(handler)](const httplib::Request& request, httplib::Response& response,
                                                const httplib::ContentReader& content) {
      if (!let_in(request, response)) {
        read_body(request, content, take_nothing);
        return;
      }
      HttpRequest asked = request_of(request);
      const bool whole = read_body(request, content, [&](std::string_view piece) {
        if (asked.body.size() + piece.size() > options_.max_body_bytes) return false;
        asked.body += piece;
        return true;
      });
      send(whole ? handler(asked) : error_response(413, "the request is too large"), response);
    };
  }

  void add_upload(const std::string& pattern, UploadHandler handler) {
    server_.Put(pattern,
                [this, handler = std::move(handler)](const httplib::Request& request, httplib::Response& response,
                                                     const httplib::ContentReader& content) {
                  if (!let_in(request, response)) {
                    read_body(request, content, take_nothing);
                    return;
                  }
                  bool is_read = false;
                  const Reader read = [&](const Take& take) {
                    std::uint64_t got = 0;
                    is_read = true;
                    return read_body(request, content, [&](std::string_view piece) {
                      got += piece.size();
                      return got <= options_.max_upload_bytes && take(piece);
                    });
                  };
                  send(handler(request_of(request), read), response);
                  if (!is_read) read_body(request, content, take_nothing);
                });
  }

  // What no route is for would be read into memory by the library.
  void add_last_routes() {
    const auto nothing = guarded_body([](const HttpRequest&) { return error_response(404, "there is no such thing"); });
    server_.Post(".*", nothing);
    server_.Put(".*", nothing);
    server_.Patch(".*", nothing);
    server_.Delete(".*", nothing);
  }

  void add_stream(const std::string& pattern, const std::string& type, SourceMaker make) {
    server_.Get(pattern,
                [this, type, make = std::move(make)](const httplib::Request& request, httplib::Response& response) {
                  if (!let_in(request, response)) return;
                  if (streams_ >= most_streams) {
                    send(error_response(503, "too many are watching already; close another page"), response);
                    return;
                  }
                  std::shared_ptr<HttpSource> source = make(request_of(request));
                  ++streams_;
                  response.set_chunked_content_provider(
                      type,
                      [this, source](std::size_t, httplib::DataSink& sink) {
                        std::string bytes;
                        if (stopping_ || !source->next(bytes)) {
                          sink.done();
                          return true;
                        }
                        if (!bytes.empty()) return sink.write(bytes.data(), bytes.size());
                        return sink.is_writable();
                      },
                      [this](bool) { --streams_; });
                });
  }

  // The page with a token in its address: the token becomes a cookie, and leaves the address bar and the history.
  bool take_token(const httplib::Request& request, httplib::Response& response) const {
    const std::string token = request.get_param_value("token");
    if (request.path != "/" || token.empty() || options_.token.empty() || !same_secret(token, options_.token)) {
      return false;
    }
    response.set_header("Set-Cookie",
                        cookie_name(port_) + "=" + token + "; Path=/; HttpOnly; SameSite=Lax; Max-Age=31536000");
    response.set_redirect("/", 303);
    return true;
  }

  bool let_in(const httplib::Request& request, httplib::Response& response) const {
    if (take_token(request, response)) return false;
    AccessRequest who;
    who.method = request.method;
    who.remote_address = request.remote_addr;
    who.host = request.get_header_value("Host");
    who.origin = request.get_header_value("Origin");
    who.token = token_of(request, port_);
    who.marked = request.has_header("X-Gyre");
    switch (access_of(who, options_.token)) {
      case Access::granted:
        return true;
      case Access::needs_token:
        send(without_token(request), response);
        return false;
      case Access::refused:
        send(error_response(403, "only this program's own page may ask for that"), response);
        return false;
    }
    return false;
  }

  // A person is told on a page, the page itself in JSON.
  HttpResponse without_token(const httplib::Request& request) const {
    const std::string remedy = "open the page with the link that has it, " + options_.link_source;
    if (request.path != "/") return error_response(401, "a token is needed here: " + remedy);
    HttpResponse response;
    response.status = 401;
    response.type = "text/html; charset=utf-8";
    const std::string title =
        request.has_param("token") ? "This link is not valid any more" : "This page needs its link";
    response.body =
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\">"
        "<link rel=\"icon\" href=\"data:,\"><title>Gyre</title><main><h1>" +
        title + "</h1><p>Only who has the token may look. To get in, " + remedy + ".</p></main></html>";
    return response;
  }

  Result<void> start() {
    if (const Result<void> valid = options_.check(); !valid) return valid;
    add_last_routes();
    const std::string where = options_.address + ":" + std::to_string(options_.port);
    if (options_.port == 0) {
      port_ = server_.bind_to_any_port(options_.address);
    } else if (server_.bind_to_port(options_.address, options_.port)) {
      port_ = options_.port;
    }
    if (port_ <= 0) {
      return fail("cannot listen for browsers", where, "another program may have the port: give another one");
    }
    ended_ = std::promise<void>();
    thread_ = std::thread([this] {
      server_.listen_after_bind();
      ended_.set_value();
    });
    while (!server_.is_running()) std::this_thread::yield();
    return {};
  }

  void stop() {
    stopping_ = true;
    server_.stop();
    if (!thread_.joinable()) return;
    // A peer that says nothing, or too little, would keep its thread waiting for as long as it likes.
    if (ended_.get_future().wait_for(stop_patience) != std::future_status::ready) hang_up(port_);
    thread_.join();
  }

  std::string address() const {
    std::string host = options_.address;
    if (host == "0.0.0.0" || host == "::") host = own_address();
    if (host.find(':') != std::string::npos) host = "[" + host + "]";
    return "http://" + host + ":" + std::to_string(port_) + "/";
  }

  std::string url() const {
    std::string url = address();
    if (!options_.token.empty() && !is_loopback_address(options_.address)) url += "?token=" + options_.token;
    return url;
  }

  HttpOptions options_;
  httplib::Server server_;
  std::thread thread_;
  std::promise<void> ended_;  // the thread is about to end
  std::atomic<int> streams_{0};
  std::atomic<bool> stopping_{false};
  int port_ = -1;
};

HttpServer::HttpServer(HttpOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

HttpServer::~HttpServer() {
  stop();
}

void HttpServer::get(const std::string& pattern, Handler handler) {
  impl_->server_.Get(pattern, impl_->guarded(std::move(handler)));
}

void HttpServer::post(const std::string& pattern, Handler handler) {
  impl_->server_.Post(pattern, impl_->guarded_body(std::move(handler)));
}

void HttpServer::put(const std::string& pattern, Handler handler) {
  impl_->server_.Put(pattern, impl_->guarded_body(std::move(handler)));
}

void HttpServer::remove(const std::string& pattern, Handler handler) {
  impl_->server_.Delete(pattern, impl_->guarded_body(handler));
  impl_->server_.Delete(pattern, impl_->guarded(std::move(handler)));  // without a body
}

void HttpServer::upload(const std::string& pattern, UploadHandler handler) {
  impl_->add_upload(pattern, std::move(handler));
}

void HttpServer::stream(const std::string& pattern, const std::string& type, SourceMaker make) {
  impl_->add_stream(pattern, type, std::move(make));
}

void HttpServer::serve(std::span<const PageFile> files) {
  const auto answer = [](const PageFile& file) {
    HttpResponse response;
    response.type = file.type;
    response.body = file.bytes;
    // The names of all but the page itself change with what is in them.
    if (file.path.starts_with("/assets/")) response.headers["Cache-Control"] = "private, max-age=31536000, immutable";
    return response;
  };
  for (const PageFile& file : files) {
    const auto handler = [&file, answer](const HttpRequest&) { return answer(file); };
    std::string pattern;
    for (const char c : file.path) pattern += c == '.' ? std::string("\\.") : std::string(1, c);
    get(pattern, handler);
    if (file.path == "/index.html") get("/", handler);
  }
}

Result<void> HttpServer::start() {
  return impl_->start();
}

void HttpServer::stop() {
  impl_->stop();
}

int HttpServer::port() const {
  return impl_->port_;
}

std::string HttpServer::address() const {
  return impl_->address();
}

std::string HttpServer::url() const {
  return impl_->url();
}

}  // namespace gyre
