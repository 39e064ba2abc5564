// Search in the index that stands in index.js: names come first, and what has most of the words. No server is asked.
(function () {
  "use strict";
  var empty = /^(a|an|the|of|to|in|on|for|and|or|is|are|i|how|do|does|can|what|why|with|my|it)$/;
  var input = document.getElementById("words"), found = document.getElementById("found");

  // Spellings of one word: optimization and optimisation, plots and plot.
  function plain(text) { return text.toLowerCase().replace(/iz(e|ation|ing|ed)/g, "is$1"); }
  function stem(word) {
    return word.length > 4 ? word.replace(/y$/, "i").replace(/(isation|ation|ions?|ings?|ed|es|s|e)$/, "") : word;
  }

  var texts = pendulaIndex.map(function (entry) {
    var title = plain(entry[0]), own = /#|:latex$/.test(title) ? title.replace(/^.*[#:]/, "") : title;
    return { title: title, names: own.split(/[^\w']+/), keys: plain(entry[5]).split(/[^\w']+/), last: title.split(/[.:#]/).pop(),
      words: plain(entry[1] + " " + entry[3]).split(/[^\w']+/), weight: entry[4] };
  });

  // How well an entry fits a word: its name, a word of its name, a word of its text, a part of a word.
  function fit(text, word) {
    var root = stem(word);
    if (text.title === word) return 30;
    if (text.last === word) return 20;
    function like(name) { return stem(name) === root; }
    if (text.names.indexOf(word) >= 0) return 16;
    if (text.names.some(like)) return 15;
    if (text.keys.indexOf(word) >= 0) return text.keys[0] === word ? 15 : 13;
    if (text.keys.some(like)) return 11;
    if (text.names.some(function (name) { return name.indexOf(root) === 0; })) return 8;
    if (text.words.indexOf(word) >= 0) return 5;
    if (text.words.some(like)) return 4;
    if (text.title.indexOf(root) >= 0 && root.length > 2) return 4;
    return text.words.some(function (name) { return name.indexOf(root) === 0; }) ? 2 : 0;
  }

  // Entries that fit most of the words come first.
  function score(text, words) {
    var fits = 0, sum = 0, best = 0;
    words.forEach(function (word) {
      var own = fit(text, word);
      if (own) fits += 1;
      sum += own;
      best = Math.max(best, own);
    });
    if (!fits) return null;
    var phrase = words.join(" ");
    if (words.length > 1 && text.title === phrase) sum += 60;
    var place = words.length > 1 ? text.keys.join(" ").indexOf(phrase) : -1;
    sum += place === 0 ? 14 : place > 0 ? 10 : 0;
    return [fits, sum + (best < 8 ? Math.min(text.weight, 0) : text.weight)];  // of a word in passing the kind is no merit
  }

  function show() {
    var words = plain(input.value).split(/\s+/).filter(function (word) { return word && !empty.test(word); });
    found.textContent = "";
    if (!words.length) return;
    var hits = [];
    texts.forEach(function (text, i) {
      var own = score(text, words);
      if (own) hits.push(own.concat(i));
    });
    hits.sort(function (a, b) { return b[0] - a[0] || b[1] - a[1] || a[2] - b[2]; });
    hits = hits.filter(function (hit) { return hit[0] === hits[0][0]; });
    hits.slice(0, 12).forEach(function (hit) {
      var entry = pendulaIndex[hit[2]], item = document.createElement("li");
      var link = document.createElement("a"), small = document.createElement("small");
      link.href = entry[2];
      link.textContent = entry[0];
      small.textContent = entry[1];
      item.append(link, small);
      found.append(item);
    });
    if (!hits.length) found.innerHTML = "<li>Nothing mentions this.</li>";
  }

  input.addEventListener("input", show);
  document.getElementById("search").addEventListener("submit", function (event) {
    event.preventDefault();
    var first = found.querySelector("a");
    if (first) location.href = first.href;
  });
})();
