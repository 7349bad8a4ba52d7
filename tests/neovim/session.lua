-- A session in neovim: opens a graph, looks at an error, completes, renames, formats, and checks the files afterwards.
local folder, program = vim.env.FOLDER, vim.env.SHIBO
vim.o.swapfile = false
vim.opt.runtimepath:append(vim.env.PLUGIN)

local function check(what, good, seen)
  if not good then
    io.stderr:write('failed: ' .. what .. ': ' .. vim.inspect(seen) .. '\n')
    vim.cmd('cquit 1')
  end
end
local function wait(what, ready, seen)
  check(what, vim.wait(60000, ready, 20), seen and seen())
end

require('shibo').setup({ cmd = { program, 'lsp' }, root = folder })
vim.cmd('edit ' .. folder .. '/a.ron')
local diagnostics = function() return vim.diagnostic.get(0, { severity = { min = vim.diagnostic.severity.WARN } }) end

-- The error is shown at its place.
wait('errors are shown', function() return #diagnostics() > 1 end)
local error = vim.tbl_filter(function(d) return d.code == 'unknown-kind' end, diagnostics())[1]
local line = vim.api.nvim_buf_get_lines(0, error.lnum, error.lnum + 1, true)[1]
check('the error is at the kind', line:sub(error.col + 1, error.end_col) == 'Perlim', error)

-- The error disappears after the edit.
vim.api.nvim_buf_set_text(0, error.lnum, error.col, error.lnum, error.end_col, { 'Perlin' })
local of = function(code) return vim.tbl_filter(function(d) return d.code == code end, diagnostics()) end
wait('the error is gone', function() return #of('unknown-kind') == 0 end, diagnostics)

-- Accepts the first offer behind a text.
local function accept(before, wanted)
  local row, column = unpack(vim.fn.searchpos(before, 'ew'))
  vim.api.nvim_win_set_cursor(0, { row, column })
  local answer = vim.lsp.buf_request_sync(0, 'textDocument/completion', vim.lsp.util.make_position_params(), 60000)
  local _, first = next(answer or {})
  local items = first and first.result and first.result.items or {}
  check(wanted .. ' is offered first', items[1] and items[1].label == wanted, items[1])
  vim.lsp.util.apply_text_edits({ items[1].textEdit }, 0, 'utf-16')
end

-- The node of the right type comes first.
accept('Dots(points: "', 'points')
wait('the graph is sound', function() return #diagnostics() == 0 end, diagnostics)

-- Renames an output in two files.
vim.fn.search('outputs: { "height')
vim.fn.search('height')
vim.lsp.buf.rename('relief')
wait('the other file is changed', function()
  local other = vim.fn.bufnr(folder .. '/b.ron')
  return other > 0 and table.concat(vim.api.nvim_buf_get_lines(other, 0, -1, true)):find('a%.relief') ~= nil
end)
if vim.lsp.buf.format then vim.lsp.buf.format({ timeout_ms = 60000 }) else vim.lsp.buf.formatting_sync(nil, 60000) end

-- The output of an imported graph, which is not open and whose path has no extension, is offered behind the dot.
vim.cmd('silent write')
vim.cmd('edit ' .. folder .. '/c.ron')
wait('the missing output is shown', function() return #diagnostics() > 0 end, diagnostics)
accept('"layer\\.', 'layer.depth')
wait('the imported output is found', function() return #diagnostics() == 0 end, diagnostics)
vim.cmd('silent wall')
vim.cmd('qall!')
