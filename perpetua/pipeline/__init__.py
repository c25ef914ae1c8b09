"""The stage table, the store on disk, and the runner that takes one room through the stages."""
