// SPDX-License-Identifier: Apache-2.0
// The web server of both programs: cpp-httplib behind Result, with access control and security headers on every answer.
#pragma once

#include "common/http/access.h"
#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

struct HttpOptions {
  std::string address = "127.0.0.1";  // to listen on
  int port = 0;                       // 0: any free one
  std::string token;                  // what peers that are not on this machine have to show; empty: none gets in
  // Tells people without it where the link is to be had, "as ..."; plain text for HTML.
  std::string link_source = "as this program printed it at its start";
  std::uint64_t max_body_bytes = 1 << 20;
  std::uint64_t max_upload_bytes = std::uint64_t{8} << 30;  // of bodies that are read piece by piece

  Result<void> check() const;
};

struct HttpRequest {
  std::string method;
  std::string path;
  std::vector<std::string> parts;            // what the groups of the route's pattern matched
  std::map<std::string, std::string> query;  // the first value of each name
  std::string body;                          // empty for uploads
};

struct HttpResponse {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  std::filesystem::path file;                  // sent in place of `body` when given
  std::map<std::string, std::string> headers;  // replace those every answer has
};

HttpResponse json_response(const nlohmann::json& json, int status = 200);
// {"error": what it says}; wrong use is a 400, anything else a 500.
HttpResponse error_response(const Error& error);
HttpResponse error_response(int status, std::string_view message);

// A file that is part of the program.
struct PageFile {
  std::string_view path;  // "/index.html"
  std::string_view type;
  std::string_view bytes;
};

// Where the bytes of an endless answer come from. Used from one thread of the server.
class HttpSource {
 public:
  HttpSource() = default;
  HttpSource(const HttpSource&) = delete;
  HttpSource& operator=(const HttpSource&) = delete;
  virtual ~HttpSource() = default;

  // Waits for what comes next and appends it to `out`; nothing for a while is fine, but it returns within two seconds,
  // so that a peer that has gone is noticed. False: there will be no more.
  virtual bool next(std::string& out) = 0;
};

// Routes are added before start(), their patterns are regular expressions for the whole path (ECMAScript). Handlers run
// on the server's threads, several at once.
class HttpServer {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;
  // read: hands over the body piece by piece until `take` returns false; false when the peer has gone or sends too
  // much.
  using Reader = std::function<bool(const std::function<bool(std::string_view)>& take)>;
  using UploadHandler = std::function<HttpResponse(const HttpRequest&, const Reader& read)>;
  using SourceMaker = std::function<std::unique_ptr<HttpSource>(const HttpRequest&)>;

  explicit HttpServer(HttpOptions options);
  ~HttpServer();  // stops
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  void get(const std::string& pattern, Handler handler);
  void post(const std::string& pattern, Handler handler);
  void put(const std::string& pattern, Handler handler);
  void remove(const std::string& pattern, Handler handler);        // DELETE
  void upload(const std::string& pattern, UploadHandler handler);  // PUT
  // GET of something without an end. A few at a time: more are answered with 503.
  void stream(const std::string& pattern, const std::string& type, SourceMaker make);
  // The files of a page; "/" is its /index.html. The files must outlive the server.
  void serve(std::span<const PageFile> files);

  // Listens and answers on threads of its own. Errors: the address is taken or not this machine's.
  Result<void> start();
  void stop();
  // Once started:
  int port() const;
  std::string address() const;  // "http://127.0.0.1:7480/", for logs, which others may read
  std::string url() const;      // the same, with the token when one is set and others may connect

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gyre
