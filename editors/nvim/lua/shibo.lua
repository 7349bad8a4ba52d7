-- The language server of Shibo in neovim, 0.7 and newer: require('shibo').setup({ cmd = { 'shibo', 'lsp' } }).
local M = {}
local clients = {}

-- Shows a file, or a page in the browser, when the server asks for it.
local function show_document(_, params, context)
  if params.external then
    local open = vim.fn.has('mac') == 1 and 'open' or 'xdg-open'
    return { success = vim.fn.executable(open) == 1 and vim.fn.jobstart({ open, params.uri }) > 0 }
  end
  local client = vim.lsp.get_client_by_id(context.client_id)
  local range = params.selection or { start = { line = 0, character = 0 }, ['end'] = { line = 0, character = 0 } }
  local encoding = client and client.offset_encoding or 'utf-16'
  vim.schedule(function()
    local show = vim.lsp.util.show_document or vim.lsp.util.jump_to_location
    show({ uri = params.uri, range = range }, encoding, vim.lsp.util.show_document and { focus = true } or nil)
  end)
  return { success = true }
end

local function run(command, ...)
  local arguments = { vim.uri_from_bufnr(0), ... }
  vim.lsp.buf_request(0, 'workspace/executeCommand', { command = command, arguments = arguments }, function(err)
    if err then vim.notify(err.message, vim.log.levels.ERROR) end
  end)
end

-- Shows the node at the cursor on the page of the graph; opens the page if necessary.
function M.show() run('shibo.show', vim.lsp.util.make_position_params(0, 'utf-16').position) end
-- Opens the page of the graph.
function M.preview() run('shibo.preview') end
-- The page of a running `shibo watch` shows the text as it is typed, until `unfollow` or the end of the buffer.
function M.follow() run('shibo.follow') end
function M.unfollow() run('shibo.unfollow') end
-- Writes the pictures of an output.
function M.render(output) run('shibo.render', output) end

function M.attach(opts, buffer)
  local path = vim.api.nvim_buf_get_name(buffer)
  local folder = vim.fn.fnamemodify(path, ':p:h')
  -- The workspace is the repository, so that renaming changes all its graphs, or else the folder of the file.
  local git = vim.fn.finddir('.git', folder .. ';')
  local root = opts.root or (git ~= '' and vim.fn.fnamemodify(git, ':p:h:h')) or folder
  if not clients[root] or not vim.lsp.get_client_by_id(clients[root]) then
    local capabilities = vim.lsp.protocol.make_client_capabilities()
    capabilities.window = vim.tbl_extend('force', capabilities.window or {}, { showDocument = { support = true } })
    clients[root] = vim.lsp.start_client({
      name = 'shibo',
      cmd = opts.cmd or { 'shibo', 'lsp' },
      root_dir = root,
      capabilities = capabilities,
      init_options = opts.options or {},
      -- A followed text reaches the page with each keystroke.
      flags = { debounce_text_changes = 20 },
      handlers = { ['window/showDocument'] = show_document },
      on_exit = function() clients[root] = nil end,
    })
  end
  if clients[root] then
    vim.lsp.buf_attach_client(buffer, clients[root])
    vim.bo[buffer].omnifunc = 'v:lua.vim.lsp.omnifunc'
  end
end

function M.setup(opts)
  opts = opts or {}
  local group = vim.api.nvim_create_augroup('shibo', {})
  vim.api.nvim_create_autocmd({ 'BufRead', 'BufNewFile' }, {
    group = group,
    pattern = '*.ron',
    callback = function(event)
      vim.bo[event.buf].filetype = 'ron'
      vim.bo[event.buf].commentstring = '// %s'
      M.attach(opts, event.buf)
      -- With `show_on_hold`, shows each node on which the cursor rests.
      if opts.show_on_hold then
        vim.api.nvim_create_autocmd('CursorHold', { group = group, buffer = event.buf, callback = M.show })
      end
    end,
  })
  vim.api.nvim_create_user_command('ShiboShow', M.show, {})
  vim.api.nvim_create_user_command('ShiboPreview', M.preview, {})
  vim.api.nvim_create_user_command('ShiboFollow', M.follow, {})
  vim.api.nvim_create_user_command('ShiboUnfollow', M.unfollow, {})
  vim.api.nvim_create_user_command('ShiboRender', function(args) M.render(args.args) end, { nargs = 1 })
end

return M
