-- A session in neovim: the page follows the text, and a change of the page is undone here.
local folder, program = vim.env.FOLDER, vim.env.SHIBO
vim.o.swapfile = false
vim.opt.runtimepath:append(vim.env.PLUGIN)

local function wait(what, ready)
  if not vim.wait(60000, ready, 20) then
    io.stderr:write('failed: ' .. what .. '\n' .. table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true), '\n') .. '\n')
    vim.cmd('cquit 1')
  end
end
local function text() return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true), '\n') end
local function exists(name) return function() return vim.fn.filereadable(folder .. '/' .. name) == 1 end end

require('shibo').setup({ cmd = { program, 'lsp' }, root = folder })
vim.cmd('edit ' .. folder .. '/graph.ron')
wait('the server is ready', function()
  local _, client = next(vim.lsp.buf_get_clients(0))
  return client and client.initialized
end)
vim.cmd('ShiboFollow')
-- A keystroke, without a save.
vim.fn.search('size: 4')
vim.cmd('normal! f4r3')
-- Undone changes end here.
vim.cmd('let &undolevels = &undolevels')
wait('the change of the page arrives', function() return text():find('default: 0.5', 1, true) end)
wait('the page has shown the change', exists('undo'))
vim.cmd('undo')
wait('the change is undone', function() return text():find('default: 0.0', 1, true) and text():find('size: 3', 1, true) end)
wait('the page has shown the text', exists('quit'))
vim.cmd('qall!')
